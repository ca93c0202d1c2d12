"""Cells of space with equally many points in each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...wire.tensors import Array

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Split:
    """A plane between two parts of space. A part is another split by its number, or a cell c as −1 − c."""

    axis: int  # across which axis
    at: float  # L; points with a smaller coordinate are below, all others above
    below: int
    above: int


@dataclass(frozen=True)
class Cut:
    """Space in cells, boxes whose outer sides are at infinity, by splits across the widest side of the points."""

    splits: list[Split]
    lower: Array  # [cells, d], L: the sides of the cells
    upper: Array

    @property
    def n_cells(self) -> int:
        """The number of cells."""
        return len(self.lower)

    @classmethod
    def of(cls, points: Array, n_cells: int) -> Cut:
        """Splits where the points `[n, d]` have medians, or quantiles where the cells to come are odd in number."""
        splits: dict[int, Split] = {}
        boxes: list[tuple[Array, Array]] = []

        def part_of(rows: Ints, n_cells: int, lower: Array, upper: Array) -> int:
            if n_cells == 1:
                boxes.append((lower, upper))
                return -len(boxes)
            own = points[rows]
            axis = int(np.argmax(np.ptp(own, axis=0))) if len(rows) else 0
            n_below = (n_cells + 1) // 2
            place = min(len(rows) * n_below // n_cells, len(rows) - 1)
            at = float(np.partition(own[:, axis], place)[place]) if len(rows) else float(max(lower[axis], 0.0))
            top, bottom = upper.copy(), lower.copy()
            top[axis] = bottom[axis] = at
            is_below, number = own[:, axis] < at, len(splits)
            splits[number] = Split(axis, at, 0, 0)
            below = part_of(rows[is_below], n_below, lower, top)
            above = part_of(rows[~is_below], n_cells - n_below, bottom, upper)
            splits[number] = Split(axis, at, below, above)
            return number

        side = np.full(points.shape[1], np.inf)
        part_of(np.arange(len(points)), n_cells, -side, side)
        ordered = [splits[number] for number in range(len(splits))]
        return cls(ordered, np.array([lower for lower, _ in boxes]), np.array([upper for _, upper in boxes]))

    def cells_of(self, points: Array) -> Ints:
        """Says in which cell points `[n, d]` are, `[n]`; equal points are in the same one."""
        cells = np.zeros(len(points), dtype=np.int64)
        waiting = [(self.splits[0], np.arange(len(points)))] if self.splits else []
        while waiting:
            split, rows = waiting.pop()
            is_below = points[rows, split.axis] < split.at
            for part, own in ((split.below, rows[is_below]), (split.above, rows[~is_below])):
                if part < 0:
                    cells[own] = -1 - part
                else:
                    waiting.append((self.splits[part], own))
        return cells

    def depths(self, cell: int, points: Array, stretch: tuple[float, ...] | None = None) -> Array:
        """Returns how far points `[n, d]` of a cell are from its nearest side, `[n]`, L or in stretched coordinates."""
        inside = np.minimum(points - self.lower[cell], self.upper[cell] - points)
        depths: Array = (inside if stretch is None else inside * np.array(stretch)).min(axis=1)
        return depths
