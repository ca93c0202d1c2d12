"""Columns of numbers by their names, and which of them are positions, normals and colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ...wire.tensors import Array

POSITIONS = ["x", "y", "z"]

NORMALS = [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]]

COLOURS = [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]]

COLOUR_SCALES = [1.0, 255.0, 65535.0]
"""The largest colours that files have: fractions, one byte, two bytes."""


@dataclass(frozen=True)
class FileCloud:
    """The points of a file, with everything else that it has for them."""

    positions: Array
    """`[n, d]`"""
    normals: Array | None = None
    """`[n, d]`"""
    columns: dict[str, Array] = field(default_factory=dict)
    """Further columns by their names, `[n]` each. Missing values are NaN."""
    colours: Array | None = None
    """Red, green and blue from 0 to 1, `[n, 3]`."""
    n_left_out: int = 0
    """The number of rows that were left out because they have no position."""

    @property
    def left_out(self) -> str | None:
        """A sentence about the rows that were left out, if there are any."""
        if self.n_left_out == 0:
            return None
        n_rows = self.n_left_out + len(self.positions)
        return f"left out without a position: {self.n_left_out} of {n_rows} point{'s' if n_rows > 1 else ''}"


@dataclass
class Columns:
    """The columns of a file. Rows stand in `lines`, or one after another, each called `record`."""

    numbers: Mapping[str, Array]
    lines: Sequence[int] | None = None
    record: str = "point"

    def cloud(self, *, has_gaps: bool = False) -> FileCloud:
        """Makes a cloud of the columns. Coordinates are `x`, `y` and, if there is one, `z`.

        Raises
        ------
        ValueError
            If there are no coordinates, a row has no position and such rows are no gaps that are left out, or a
            normal is not finite.
        """
        lower = {name.lower(): name for name in self.numbers}
        if "x" not in lower or "y" not in lower:
            raise ValueError(f"the file has no columns x and y: {', '.join(self.numbers)}")
        positions = [lower[axis] for axis in POSITIONS if axis in lower]
        if len(self.numbers[positions[0]]) == 0:
            raise ValueError("the file has no points")
        d = len(positions)
        normals = _group(lower, [names[:d] for names in NORMALS])
        colours = _group(lower, COLOURS)
        known, n_left_out = self._without_gaps(positions, has_gaps=has_gaps)
        known.check_finite(normals)
        used = {*positions, *normals, *colours}
        return FileCloud(
            positions=known.side_by_side(positions),
            normals=known.side_by_side(normals) if normals else None,
            columns={name: column for name, column in known.numbers.items() if name not in used},
            colours=_fractions(known.side_by_side(colours)) if colours else None,
            n_left_out=n_left_out,
        )

    def side_by_side(self, names: Sequence[str]) -> Array:
        """Returns columns as one array."""
        return np.column_stack([self.numbers[name] for name in names])

    def check_finite(self, names: Sequence[str]) -> None:
        """Refuses numbers that are not finite, with the place of the first and the number of rows with such.

        Raises
        ------
        ValueError
            If there is such a number.
        """
        if not names:
            return
        broken = ~np.isfinite(self.side_by_side(names))
        rows = np.flatnonzero(broken.any(axis=1))
        if len(rows) == 0:
            return
        row = int(rows[0])
        name = names[int(np.argmax(broken[row]))]
        place = f"{self.record} {row + 1} of {len(broken)}" if self.lines is None else f"line {self.lines[row]}"
        said = "NaN" if np.isnan(self.numbers[name][row]) else "infinite"
        others = f". {len(rows)} rows have such numbers" if len(rows) > 1 else ""
        raise ValueError(f"{place}: {name} is {said}{others}")

    def _without_gaps(self, positions: Sequence[str], *, has_gaps: bool) -> tuple[Columns, int]:
        """Leaves rows without a position out. Also returns their number."""
        if not has_gaps:
            self.check_finite(positions)
            return self, 0
        kept: npt.NDArray[np.bool_] = np.all(np.isfinite(self.side_by_side(positions)), axis=1)
        n_left_out = len(kept) - int(np.count_nonzero(kept))
        if n_left_out == len(kept):
            raise ValueError(f"no point has a position, of {len(kept)}")
        lines = (
            None if self.lines is None else [line for line, is_kept in zip(self.lines, kept, strict=True) if is_kept]
        )
        numbers = {name: column[kept] for name, column in self.numbers.items()}
        return Columns(numbers, lines, self.record), n_left_out


def _group(lower: Mapping[str, str], groups: Sequence[Sequence[str]]) -> list[str]:
    """Returns the names of the first group whose columns are all there."""
    for group in groups:
        if all(name in lower for name in group):
            return [lower[name] for name in group]
    return []


def _fractions(colours: Array) -> Array:
    """Scales colours by the largest number of their type, which is guessed from the largest one present."""
    largest = float(np.nanmax(colours, initial=0.0))
    return colours / next((scale for scale in COLOUR_SCALES if largest <= scale), largest)
