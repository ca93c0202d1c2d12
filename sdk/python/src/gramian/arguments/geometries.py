"""Geometries of other libraries: their positions and normals. None of these libraries is imported.

| library | classes | normals |
|---|---|---|
| trimesh | `Trimesh`, `PointCloud`, `Scene` | those of the vertices, if neighbouring triangles agree on the side |
| PyVista | `PolyData` and other data sets | the array `Normals` of the points |
| Open3D | `PointCloud`, `TriangleMesh` | those that it has |
| meshio | `Mesh` | the array `Normals` of the points |
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt


class HasVertices(Protocol):
    """A mesh or a cloud of trimesh, or a mesh of Open3D."""

    @property
    def vertices(self) -> Any: ...  # noqa: ANN401, D102


class HasPoints(Protocol):
    """A data set of PyVista, a cloud of Open3D, or a mesh of meshio."""

    @property
    def points(self) -> Any: ...  # noqa: ANN401, D102


GeometryLike: TypeAlias = HasVertices | HasPoints


class Geometry(NamedTuple):
    """Positions `[n, d]`, and normals `[n, d]` if each position has one."""

    positions: npt.NDArray[Any]
    normals: npt.NDArray[Any] | None


def geometry_of(value: object) -> Geometry | None:
    """Returns the positions and normals of a geometry. None if the value is something else, such as an array."""
    if isinstance(value, Mapping) or hasattr(value, "__array__"):
        return None
    found: Any = value
    if hasattr(found, "geometry") and hasattr(found, "to_mesh"):
        found = found.to_mesh()  # a scene of trimesh, with its transforms
    places = found.vertices if hasattr(found, "vertices") else getattr(found, "points", None)
    if places is None or isinstance(places, str | bytes):
        return None
    positions = np.asarray(places)
    return Geometry(positions, _known(_normals(found), positions))


def positions_of(value: object) -> object:
    """Returns the positions of a geometry, and any other value unchanged."""
    geometry = geometry_of(value)
    return value if geometry is None else geometry.positions


def _normals(geometry: Any) -> Any:  # noqa: ANN401 (of each library)
    """Returns the normals that a geometry has at its positions, or None."""
    for has, name in (("has_vertex_normals", "vertex_normals"), ("has_normals", "normals")):  # of Open3D
        if hasattr(geometry, has):
            return getattr(geometry, name) if getattr(geometry, has)() else None
    if hasattr(geometry, "is_winding_consistent"):  # of trimesh
        return geometry.vertex_normals if geometry.is_winding_consistent else None
    data = getattr(geometry, "point_data", None)  # of PyVista and meshio
    return None if data is None else data.get("Normals")


def _known(normals: Any, positions: npt.NDArray[Any]) -> npt.NDArray[Any] | None:  # noqa: ANN401
    """Returns normals if each position has one: a vertex without triangles has none, for example."""
    if normals is None:
        return None
    rows = np.asarray(normals, dtype=np.float64)
    if rows.shape != positions.shape or not np.isfinite(rows).all():
        return None
    return rows if (np.linalg.norm(rows, axis=1) > 0).all() else None
