"""Meshes of surfaces, and their files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
import numpy.typing as npt

from ..arguments.options import SurfaceFit
from ..export import Table
from ..export.table import AXES, NORMAL
from ..rest.models import Diagnostics, MeshPart
from ..wire.tensors import Array, Integers, Members
from .answer import Answer
from .asked import asked
from .fit import surface_fit_used, values_fit_used
from .summary import counted

if TYPE_CHECKING:
    from trimesh import Trimesh

SUPPORT = ("observed", "bridged", "extrapolated")
"""Support of a vertex, from most to least certain. Files have the position in this list."""


SHOWN_PARTS = 3
"""Number of parts in a summary, the largest ones."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Mesh(Answer):
    """A mesh of segments in the plane (d = 2) or triangles in space (d = 3).

    It has k vertices and l cells. `include="curvatures"` and `std=True` ask for curvatures and deviations.

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
    principal_curvatures: Array = asked('include="curvatures"')
    mean_curvatures: Array = asked('include="curvatures"')
    position_std: Array = asked("std=True")
    normal_std: Array = asked("std=True")
    principal_curvature_std: Array = asked('include="curvatures", std=True')
    mean_curvature_std: Array = asked('include="curvatures", std=True')
    parts: tuple[MeshPart, ...]
    dropped_parts: tuple[MeshPart, ...]
    closedness: float | None = None
    diagnostics: Diagnostics
    fit: SurfaceFit

    ROWS: ClassVar = "k"
    WORDS: ClassVar = {"support": SUPPORT}
    SUMMARY: ClassVar = ("mean_curvatures", "residuals")

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer and the options of its fit."""
        fit = values_fit_used(members) if "values" in members.request else surface_fit_used(members)
        lists = {"cells": members.integers("cells"), "support": np.array(members["support"], dtype=np.str_)}
        return super().read(members, fit=fit, **lists, **derived)

    def __str__(self) -> str:
        parts = ", ".join(f"{part.n_cells:,} (χ = {part.euler_characteristic})" for part in self.parts[:SHOWN_PARTS])
        more = f" and {len(self.parts) - SHOWN_PARTS} more" if len(self.parts) > SHOWN_PARTS else ""
        head, *others = super().__str__().splitlines()
        support = counted(iter(self.support.tolist()))
        return "\n".join([head, f"parts by cells: {parts}{more}; vertices: {support}", *others])

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

    def plot(
        self,
        quantity: str | None = None,
        *,
        backend: Literal["matplotlib", "pyvista"] = "matplotlib",
        length_unit: str = "L",
        value_unit: str = "V",
        **looks: Any,  # noqa: ANN401 (of LevelSetDisplay.plot)
    ) -> Any:  # noqa: ANN401 (a LevelSetDisplay, or a Plotter of pyvista)
        """Draws the mesh, coloured by a quantity: the mean curvatures if there are any, or else the residuals.

        The parameters are those of `Curvatures.plot`.
        """
        from ..plot import LevelSetDisplay

        units = (length_unit, value_unit)
        if backend == "pyvista":
            return self._turned(None, quantity, units)
        return LevelSetDisplay.from_answer(self, quantity, units).plot(**looks)

    def _writers(self, table: Callable[[], Table]) -> dict[str, Callable[[], bytes]]:
        """Returns the writers of tables, and those of trimesh for triangles alone."""
        others = {ending: partial(self._exported, ending[1:]) for ending in (".glb", ".obj", ".stl")}
        return {**super()._writers(table), **others}

    def _exported(self, file_type: str) -> bytes:
        written = self.to_trimesh().export(file_type=file_type)
        return written.encode() if isinstance(written, str) else bytes(written)

    def _attributes(self) -> dict[str, Array]:
        """Returns numbers of the vertices by their names in files."""
        columns = self._table(None, None)
        numbers = {name: column for name, column in columns.columns().items() if name not in (*AXES, *NORMAL)}
        return {**numbers, **{name: codes.astype(np.float64) for name, codes in columns.codes().items()}}
