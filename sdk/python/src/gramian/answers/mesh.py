"""Meshes of surfaces, and their files."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
import numpy.typing as npt

from ..arguments.options import SurfaceFit
from ..rest.models import Diagnostics, MeshPart
from ..wire.tensors import Array, Integers, Members
from .answer import Answer, numbers_of
from .files import replace_file
from .fit import surface_fit_used, values_fit_used

if TYPE_CHECKING:
    from trimesh import Trimesh

SUPPORT = ("observed", "bridged", "extrapolated")
"""Support of a vertex, from most to least certain. Files have the position in this list."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Mesh(Answer):
    """A mesh of segments in the plane (d = 2) or triangles in space (d = 3).

    It has k vertices and l cells. Curvatures and deviations are None unless requested.

    Attributes
    ----------
    vertices
        `[k, d]`, L.
    cells
        `[l, d]`. The vertices of each segment or triangle, counted from 0. Triangles run counter-clockwise
        seen from the side of the normals, segments counter-clockwise around the inside.
    normals
        `[k, d]`, of length 1, outward unless requested otherwise.
    support
        k words: `observed` near points of the cloud, `bridged` where it has a hole with points around, and
        `extrapolated` beyond its points.
    residuals
        `[k]`, L. Distance of each vertex from the level.
    principal_curvatures
        `[k, d − 1]`, 1/L, ascending.
    mean_curvatures
        `[k]`, 1/L. The average of the principal curvatures.
    position_std
        `[k]`, L. Standard deviation of each vertex along its normal.
    normal_std
        `[k]`, radians. Standard deviation of the angle of the normal.
    principal_curvature_std
        `[k, d − 1]`, 1/L. Standard deviations of the principal curvatures.
    mean_curvature_std
        `[k]`, 1/L. Standard deviations of the mean curvatures.
    parts
        The connected parts of the mesh, largest first, with their Euler characteristics and areas.
    dropped_parts
        Parts that were left out, since no point is near them or they are too small to mean anything.
    closedness
        Share of the points with an inside and an outside. None for a level of values.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    vertices: Array
    cells: Integers
    normals: Array
    support: npt.NDArray[np.str_]
    residuals: Array
    principal_curvatures: Array | None = None
    mean_curvatures: Array | None = None
    position_std: Array | None = None
    normal_std: Array | None = None
    principal_curvature_std: Array | None = None
    mean_curvature_std: Array | None = None
    parts: tuple[MeshPart, ...]
    dropped_parts: tuple[MeshPart, ...]
    closedness: float | None = None
    diagnostics: Diagnostics
    fit: SurfaceFit

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer and the options of its fit."""
        fit = values_fit_used(members) if "values" in members.request else surface_fit_used(members)
        lists = {"cells": members.integers("cells"), "support": np.array(members["support"], dtype=np.str_)}
        return super().read(members, fit=fit, **lists, **derived)

    def to_trimesh(self) -> Trimesh:
        """Returns the triangles as a mesh of trimesh, with all that is known of the vertices as attributes.

        Raises
        ------
        ModuleNotFoundError
            If trimesh is not installed, the extra `gramian[mesh]`.
        ValueError
            If the mesh has segments.
        """
        try:
            import trimesh
        except ModuleNotFoundError as error:
            message = "trimesh is not installed: pip install 'gramian[mesh]'"
            raise ModuleNotFoundError(message, name="trimesh") from error
        if self.cells.shape[1] != 3:
            raise ValueError("a mesh in the plane has segments, and trimesh holds triangles")
        return trimesh.Trimesh(
            self.vertices, self.cells, vertex_normals=self.normals, vertex_attributes=self._attributes(), process=False
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the triangles to a file: `.ply` with all that is known of the vertices, `.glb` or `.obj`.

        An older file is replaced once the new one is whole.

        Raises
        ------
        ModuleNotFoundError, ValueError
            As `to_trimesh`, and `ValueError` for another ending of the name.
        """
        name = os.fspath(path)
        if not name.lower().endswith((".ply", ".glb", ".obj")):
            raise ValueError(f"the name of a mesh ends with .ply, .glb or .obj, not as {name!r} does")
        written = self.to_trimesh().export(file_type=name.lower().rpartition(".")[2])
        replace_file(path, written.encode() if isinstance(written, str) else written)

    def plot(
        self,
        quantity: str | None = None,
        *,
        backend: Literal["matplotlib", "pyvista"] = "matplotlib",
        **looks: Any,  # noqa: ANN401 (of LevelSetDisplay.plot)
    ) -> Any:  # noqa: ANN401 (a LevelSetDisplay, or a Plotter of pyvista)
        """Draws the mesh, coloured by a quantity: the mean curvatures if there are any, or else the residuals.

        The parameters are those of `Curvatures.plot`.
        """
        from ..plot import LevelSetDisplay
        from ..plot.surfaces import shown_by_pyvista

        if backend == "matplotlib":
            return LevelSetDisplay.from_answer(self, quantity).plot(**looks)
        return shown_by_pyvista(self.to_pyvista(), quantity)

    def to_pyvista(self) -> Any:  # noqa: ANN401 (PolyData)
        """Returns the mesh with the numbers of its vertices as a `pyvista.PolyData`."""
        from ..plot.surfaces import to_pyvista

        numbers = {name: array for name, array in numbers_of(self, len(self.vertices)).items() if name != "vertices"}
        return to_pyvista(self.vertices, self.cells, numbers | {"support": self._support_codes()})

    def _attributes(self) -> dict[str, Array]:
        """Returns numbers of the vertices by their names in files: singular, with an index for components."""
        numbers = numbers_of(self, len(self.vertices))
        columns = {
            f"{name.removesuffix('s')}_{at}" if array.ndim == 2 else name.removesuffix("s"): column
            for name, array in numbers.items()
            if name not in ("vertices", "normals")
            for at, column in enumerate(array.reshape(len(array), -1).T)
        }
        return columns | {"support": self._support_codes()}

    def _support_codes(self) -> Array:
        return np.array([SUPPORT.index(word) for word in self.support], dtype=np.float64)
