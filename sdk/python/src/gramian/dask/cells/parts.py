"""Points on their way from the blocks of an array to tiles, and the nearest ones across the sides of cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from ...wire.tensors import Array
from .cut import Cut, Ints

SLACK = 1 + 1e-9
"""By how much more is taken than distances say, which are rounded."""

MAX_FOUND = 10_000_000
"""Neighbours that are held at once; rims of noisy clouds have thousands for each place that looks for them."""


@dataclass(frozen=True)
class Part:
    """Some of the points of a cloud."""

    index: Ints  # [n], ascending: rows in the cloud
    points: Array  # [n, d], L
    values: Array | None = None  # [n], V

    def __len__(self) -> int:
        return len(self.index)

    def __getitem__(self, rows: Ints) -> Part:
        values = None if self.values is None else self.values[rows]
        return Part(self.index[rows], self.points[rows], values)


@dataclass(frozen=True)
class Looking:
    """Positions that may have neighbours beyond the sides of their cell."""

    points: Array  # [n, d], L
    radii: Array  # [n], L: how far the neighbours may be


@dataclass(frozen=True)
class Reach:
    """Which neighbours count."""

    count: int  # of each position
    are_distinct: bool = True  # whether points that coincide count once, by the first of them
    stretch: tuple[float, ...] | None = None  # [d]: factors of coordinates before distances are taken

    def stretched(self, points: Array) -> Array:
        """Returns points in the coordinates in which distances are taken."""
        return points if self.stretch is None else points * np.array(self.stretch)

    def candidates(self, part: Part) -> Part:
        """Returns the points that count."""
        return part[distinct(part.points)] if self.are_distinct else part


def distinct(points: Array) -> Ints:
    """Returns the places of the first point of each position, ascending."""
    return np.sort(np.unique(points, axis=0, return_index=True)[1])


def split(block: Array, first: int, cut: Cut, values: Array | None = None) -> list[Part]:
    """Sorts the rows of a block, of which the first is row `first` of the cloud, into cells."""
    cells = cut.cells_of(block)
    order = np.argsort(cells, kind="stable")
    bounds = np.searchsorted(cells[order], np.arange(cut.n_cells + 1))
    whole = Part(np.arange(first, first + len(block)), block, values)
    return [whole[order[start:end]] for start, end in pairwise(bounds.tolist())]


def join(parts: Sequence[Part]) -> Part:
    """Puts parts together in the order of the cloud; points that are in several are taken once."""
    index = np.concatenate([part.index for part in parts])
    index, rows = np.unique(index, return_index=True)
    values = [part.values for part in parts if part.values is not None]
    points = np.concatenate([part.points for part in parts])[rows]
    return Part(index, points, np.concatenate(values)[rows] if values else None)


def look(core: Part, cell: int, cut: Cut, reach: Reach, queries: Part | None = None) -> Looking:
    """Finds the positions of a cell that may have one of their nearest points in another cell.

    These are those of queries, or the core's own points. The nearest ones of the core bound how far they look.
    """
    own = reach.candidates(core)
    points = own.points if queries is None else queries.points
    if len(points) == 0:
        return Looking(points, np.empty(0))
    radii = np.full(len(points), np.inf)
    if len(own) >= reach.count:
        tree = cKDTree(reach.stretched(own.points))
        radii = tree.query(reach.stretched(points), [reach.count])[0][:, 0]
    beyond = radii * SLACK >= cut.depths(cell, points, reach.stretch)
    return Looking(points[beyond], radii[beyond])


def rim(core: Part, looking: Looking, reach: Reach) -> Part:
    """Returns the points of a core that may be among the nearest of those who look from another cell."""
    nobody = core[np.arange(0)]
    if len(core) == 0 or len(looking.points) == 0:
        return nobody
    places, own = reach.stretched(looking.points), reach.stretched(core.points)
    lower, upper = own.min(axis=0), own.max(axis=0)
    away = np.linalg.norm(np.maximum(0, np.maximum(lower - places, places - upper)), axis=1)
    places, radii = places[away <= looking.radii * SLACK], looking.radii[away <= looking.radii * SLACK]
    if len(places) == 0:
        return nobody
    low, high = (places - radii[:, None] * SLACK).min(axis=0), (places + radii[:, None] * SLACK).max(axis=0)
    near = reach.candidates(core[np.flatnonzero(((own >= low) & (own <= high)).all(axis=1))])
    return near[nearest(near, places, reach, radii)] if len(near) else nobody


def nearest(part: Part, places: Array, reach: Reach, radii: Array | None = None) -> Ints:
    """Returns the rows of a part that are among the nearest of some stretched places `[n, d]`; ascending, each once."""
    is_near = np.zeros(len(part), dtype=bool)
    count = min(reach.count, len(part))
    if count == 0:
        return np.arange(0)
    tree, step = cKDTree(reach.stretched(part.points)), max(MAX_FOUND // count, 1)
    for first in range(0, len(places), step):
        some = slice(first, first + step)
        within = np.full(len(places[some]), np.inf) if radii is None else radii[some] * SLACK
        distances, rows = tree.query(places[some], count, distance_upper_bound=float(within.max()) * 2)
        distances, rows = distances.reshape(-1, count), rows.reshape(-1, count)
        is_near[rows[np.isfinite(distances) & (distances <= within[:, None])]] = True
    return np.flatnonzero(is_near)
