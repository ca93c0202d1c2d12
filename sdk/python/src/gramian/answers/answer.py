"""The base class of all answers."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal, Self

import numpy as np
import numpy.typing as npt

from .. import export
from ..arguments.describe import described
from ..plot.quantities import default_quantity
from ..rest.models import Diagnostics, FamilyScore, Flag, KernelUsed, MeshPart, SurfaceModelUsed
from ..wire.tensors import Array, Members
from .html import page_of
from .summary import summary_of

OBJECTS: Mapping[str, Callable[[Any], object]] = {
    "diagnostics": Diagnostics.from_dict,
    "kernel": KernelUsed.from_dict,
    "flags": lambda entries: tuple(map(Flag.from_dict, entries)),
    "parts": lambda parts: tuple(map(MeshPart.from_dict, parts)),
    "dropped_parts": lambda parts: tuple(map(MeshPart.from_dict, parts)),
    "families": lambda entries: tuple(map(FamilyScore.from_dict, entries)),
    "surface_models": lambda names: tuple(map(SurfaceModelUsed, names)),
}
"""Readers of the members that are neither arrays nor single numbers, by name."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer:
    """The base class of all answers.

    `print` shows a summary in a few lines, `repr` the arrays by their shapes.

    Attributes
    ----------
    positions
        `[m, d]`, L. The queries, or without them the points. None if the client has no copy of the points.
    """

    positions: Array | None = None

    ROWS: ClassVar[str] = "m"
    """Name of the axis of arrays that has an entry for each position."""

    WORDS: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Members that have a word for each position, with all their words in the order of their codes in files."""

    SUMMARY: ClassVar[tuple[str, ...]] = ()
    """Quantities of the summary."""

    def __repr__(self) -> str:
        arrays = {name: value for name, value in self._shown().items() if _is_array(value)}
        reasons = Counter(flag.reason.value for flag in getattr(self, "flags", ()))
        solver = {"solver": self.diagnostics.solver} if hasattr(self, "diagnostics") else {}
        return described(type(self).__name__, {**arrays, "flags": dict(reasons) or None, **solver})

    def __str__(self) -> str:
        return summary_of(self)

    def _repr_html_(self) -> str:
        return page_of(type(self).__name__, self._shown())

    def _shown(self) -> dict[str, object]:
        # `fit` is left out, because it repeats the diagnostics and the request, and so do positions and data.
        return {name: value for name, value in vars(self).items() if name not in ("fit", "positions", "data")}

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer, whose members have the names of the fields.

        `derived` has the fields that are not read so, and the `points` of the cloud for those that are made of them.

        Raises
        ------
        TypeError
            If the answer lacks a member without default.
        """
        names = [field.name for field in fields(cls) if field.name in members and field.name not in derived]
        found: dict[str, Any] = {name: _member(members, name) for name in names}
        return cls(**found | {name: value for name, value in derived.items() if name != "points"})

    def by_rows(self, name: str) -> Array:
        """Returns an array with its rows first, one for each position: `[m, k]` for `[k, m]`.

        Raises
        ------
        AttributeError
            If the request did not ask for this member.
        ValueError
            If the member is not an array with a row for each position.
        """
        axes = self._quantity(name).axes
        if axes.count(self.ROWS) != 1:
            raise ValueError(f"{type(self).__name__} has no {name} with a number for each position")
        return np.moveaxis(getattr(self, name), axes.index(self.ROWS), 0)

    def unit(self, name: str, length: str = "L", value: str = "V") -> str:
        """Returns the unit of a member, in terms of the units of lengths and values. Empty if it has none.

        >>> gramian.cloud([[0, 0], [1, 0], [1, 1], [0, 1]]).curvatures().unit("mean_curvatures", "mm")
        '1/mm'
        """
        dimension = self.diagnostics.dimension if hasattr(self, "diagnostics") else 1
        return export.in_units(self._quantity(name).unit, dimension, length, value)

    def _quantity(self, name: str) -> export.Quantity:
        return export.quantities_of(type(self)).get(name, export.Quantity((), ""))

    def plot(
        self,
        quantity: str | None = None,
        *,
        positions: npt.ArrayLike | None = None,
        places: npt.ArrayLike | None = None,
        backend: Literal["matplotlib", "pyvista"] = "matplotlib",
        length_unit: str = "L",
        value_unit: str = "V",
        **looks: Any,  # noqa: ANN401 (of the display)
    ) -> Any:  # noqa: ANN401 (a display, or a Plotter of pyvista)
        """Draws a quantity at the positions: coloured points of a plane or of space, or a function along a line.

        Colours fade to grey where the standard deviation is large. Along a line, a band has the function with 95 %.

        Parameters
        ----------
        quantity : str, optional
            Name of a member, such as `"gaussian_curvatures"`. The mean curvatures, values or means if absent.
        positions : array_like, `[m, d]`, optional
            The queries, if the client has no copy of them.
        places : array_like, `[m]`, optional
            Where the queries are along a line. By default x, if that is the only coordinate, or the length of the way
            from the first query to each, if there are more than three.
        backend : str, optional
            `"pyvista"` for a picture that can be turned (extra `pyvista`). `"matplotlib"` if absent (extra `plot`).
        length_unit, value_unit : str, optional
            Units of lengths and values in the names of axes, such as `"mm"`. L and V if absent.
        **looks
            Options of `gramian.plot.SurfaceDisplay.plot` or `gramian.plot.PosteriorDisplay.plot`.

        Returns
        -------
        SurfaceDisplay, PosteriorDisplay or pyvista.Plotter
            With pyvista, `show()` shows it.
        """
        # Imported here, as the parts of gramian.plot are needed only for pictures.
        from ..plot import PosteriorDisplay, SurfaceDisplay

        units = (length_unit, value_unit)
        if backend == "pyvista":
            return self._turned(positions, quantity, units)
        where = self.positions if positions is None else np.asarray(positions, dtype=np.float64)
        if places is not None or (where is not None and where.shape[1] not in (2, 3)):
            line = None if places is None else np.asarray(places, dtype=np.float64)
            return PosteriorDisplay.from_answer(self, quantity, line, units).plot(**looks)
        return SurfaceDisplay.from_answer(self, quantity, where, units).plot(**looks)

    def _turned(self, positions: npt.ArrayLike | None, quantity: str | None, units: tuple[str, str]) -> Any:  # noqa: ANN401 (Plotter)
        """Returns a plotter of pyvista."""
        from ..plot.surfaces import shown_by_pyvista

        name = quantity or default_quantity(self) or ""
        return shown_by_pyvista(self.to_pyvista(positions, quantity=name), name, self.unit(name, *units))

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        quantity: str | None = None,
        positions: npt.ArrayLike | None = None,
    ) -> None:
        """Writes positions, all numbers, flags and colours to a file. An older file is replaced once it is whole.

        - `.ply` for MeshLab, CloudCompare and Blender: a property for each number, named in the singular. MeshLab
          colours by `quality`, which repeats the shown quantity.
        - `.vtp` for ParaView, VisIt and PyVista: the arrays by their names, vectors as vectors.
        - `.csv` for spreadsheets: a column for each number, and flags in words.
        - `.npz` for NumPy: the arrays in their shapes, the flags, and the diagnostics as JSON.

        Parameters
        ----------
        path : path
            The file. Its ending determines the format.
        quantity : str, optional
            Name of the member that colours and `quality` show. That of `plot()` if absent.
        positions : array_like, `[m, d]`, optional
            The queries, if the client has no copy of them.

        Raises
        ------
        ValueError
            If the ending is not one of these, or if the format needs positions in at most three coordinates that are
            known.
        """
        export.save(path, self._writers(lambda: self._table(positions, quantity)))

    def to_pandas(self, *, positions: npt.ArrayLike | None = None) -> Any:  # noqa: ANN401 (DataFrame)
        """Returns a `pandas.DataFrame`, a row for each position: the columns of a `.csv` file (extra `pandas`)."""
        return export.to_pandas(self._table(positions, None))

    def to_pyvista(self, positions: npt.ArrayLike | None = None, *, quantity: str | None = None) -> Any:  # noqa: ANN401 (PolyData)
        """Returns a `pyvista.PolyData` with the arrays of a `.vtp` file (extra `pyvista`)."""
        return export.to_pyvista(self._table(positions, quantity))

    def _table(self, positions: npt.ArrayLike | None, quantity: str | None) -> export.Table:
        return export.table_of(self, positions, quantity)

    def _writers(self, table: Callable[[], export.Table]) -> dict[str, Callable[[], bytes]]:
        """Returns the writers of files by ending."""
        return {**export.writers_of(table), ".npz": lambda: export.npz_of(self, self._arrays())}

    def _arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Returns the arrays of an `.npz` file."""
        arrays = {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return arrays | {name: np.array(getattr(self, name), dtype=np.str_) for name in self.WORDS}


def _is_array(value: object) -> bool:
    """Returns whether a member is an array, a sparse matrix, a list of these, or a number."""
    return isinstance(value, np.ndarray | list | float) or hasattr(value, "tocsr")


def _member(members: Members, name: str) -> object:
    if name in OBJECTS:
        return OBJECTS[name](members[name])
    return members.array(name) if isinstance(members[name], np.ndarray | list) else members[name]
