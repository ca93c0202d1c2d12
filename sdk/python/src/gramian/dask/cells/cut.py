"""Cells of space with equally many points in each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...wire.tensors import Array

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Cut:
    """Space in cells, boxes whose outer sides are at infinity, by splits across the widest side of the points.

    Attributes
    ----------
    axes
        `[s]`. Of each split the axis that it is across.
    at
        `[s]`, L. Where: points with a smaller coordinate go left, all others right.
    children
        `[s, 2]`. The split on the left and on the right, or a cell c as −1 − c.
    lower, upper
        `[cells, d]`, L. The sides of the cells.
    """

    axes: Ints
    at: Array
    children: Ints
    lower: Array
    upper: Array

    @property
    def n_cells(self) -> int:
        """The number of cells."""
        return len(self.lower)

    @classmethod
    def of(cls, points: Array, n_cells: int) -> Cut:
        """Splits where the points `[n, d]` have medians, or quantiles where the cells to come are odd in number."""
        return _Cutter(points).cut(n_cells)

    def cells_of(self, points: Array) -> Ints:
        """Says in which cell points `[n, d]` are, `[n]`; equal points are in the same one."""
        cells = np.zeros(len(points), dtype=np.int64)
        waiting = [(0, np.arange(len(points)))] if len(self.axes) else []
        while waiting:
            split, rows = waiting.pop()
            is_left = points[rows, self.axes[split]] < self.at[split]
            for child, part in zip(self.children[split].tolist(), (rows[is_left], rows[~is_left]), strict=True):
                if child < 0:
                    cells[part] = -1 - child
                else:
                    waiting.append((child, part))
        return cells

    def depths(self, cell: int, points: Array, stretch: Array | None = None) -> Array:
        """Returns how far points `[n, d]` of a cell are from its nearest side, `[n]`, L or in stretched coordinates."""
        inside = np.minimum(points - self.lower[cell], self.upper[cell] - points)
        depths: Array = (inside if stretch is None else inside * stretch).min(axis=1)
        return depths


class _Cutter:
    """Collects splits and cells, depth first."""

    def __init__(self, points: Array) -> None:
        self._points = points
        self._splits: list[tuple[int, float]] = []
        self._children: list[list[int]] = []
        self._boxes: list[tuple[Array, Array]] = []

    def cut(self, n_cells: int) -> Cut:
        dimension = self._points.shape[1]
        side = np.full(dimension, np.inf)
        self._split(np.arange(len(self._points)), n_cells, (-side, side))
        return Cut(
            np.array([axis for axis, _ in self._splits], dtype=np.int64),
            np.array([at for _, at in self._splits], dtype=np.float64),
            np.array(self._children, dtype=np.int64).reshape(-1, 2),
            np.array([lower for lower, _ in self._boxes]),
            np.array([upper for _, upper in self._boxes]),
        )

    def _split(self, rows: Ints, n_cells: int, box: tuple[Array, Array]) -> int:
        """Returns the number of the split of these points, or that of their cell as −1 − c."""
        lower, upper = box
        if n_cells == 1:
            self._boxes.append(box)
            return -len(self._boxes)
        points = self._points[rows]
        axis = int(np.argmax(np.ptp(points, axis=0))) if len(rows) else 0
        n_left = (n_cells + 1) // 2
        place = min(len(rows) * n_left // n_cells, len(rows) - 1)
        at = float(np.partition(points[:, axis], place)[place]) if len(rows) else float(max(lower[axis], 0.0))
        number = len(self._splits)
        self._splits.append((axis, at))
        self._children.append([0, 0])
        middle = upper.copy(), lower.copy()
        middle[0][axis] = middle[1][axis] = at
        is_left = points[:, axis] < at
        self._children[number] = [
            self._split(rows[is_left], n_left, (lower, middle[0])),
            self._split(rows[~is_left], n_cells - n_left, (middle[1], upper)),
        ]
        return number
