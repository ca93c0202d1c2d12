"""Fewer points, spread as the cloud is."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ...wire.tensors import Array
from .cut import Ints

# As the service has them: numerics/src/points/thinning.rs.
MAX_COARSE = 6000
LEAST_COARSE = 600
POINTS_PER_COARSE = 6


def n_coarse(n_points: int) -> int:
    """Returns how many of n points say which side is outward."""
    return min(n_points, max(LEAST_COARSE, min(MAX_COARSE, n_points // POINTS_PER_COARSE)))


def thinned(points: Array, count: int) -> Ints:
    """Chooses `count` of the points `[n, d]`, one for each of as many parts with equally many points; ascending.

    Parts come about by halving along the line between two points that are far apart; of each it is the point in the
    middle. Where several are there, they are in the order of their indices.
    """
    if count >= len(points):
        return np.arange(len(points))
    chosen: list[int] = []
    waiting = [(np.arange(len(points)), max(count, 1))]
    while waiting:
        rows, wanted = waiting.pop()
        along = _along(points[rows])
        middle = (len(rows) - 1) // 2
        at = np.partition(along, middle)[middle]
        is_left, equal = along < at, np.flatnonzero(along == at)
        n_equal = middle - int(is_left.sum())
        if wanted == 1:
            chosen.append(int(rows[equal[n_equal]]))
            continue
        is_left[equal[: n_equal + 1]] = True
        parts = ((rows[is_left], (wanted + 1) // 2), (rows[~is_left], wanted // 2))
        waiting += [(part, share) for part, share in parts if len(part) and share]
    return np.sort(np.array(chosen, dtype=np.int64))


def _along(points: Array) -> Array:
    """Returns where points `[n, d]` come along a line between two that are far apart."""
    start = points[_squares(points - points.mean(axis=0)).argmax()]
    end = points[_squares(points - start).argmax()]
    places: Array = (points - start) @ (end - start)
    return places


def _squares(arms: Array) -> Array:
    squares: Array = np.einsum("ij,ij->i", arms, arms)
    return squares


def distinct(points: Array) -> Ints:
    """Returns the places of the first point of each position, ascending; all places where no two coincide."""
    if len(points) == 0:
        return np.arange(0)
    order = np.lexsort((np.arange(len(points)), *points.T))
    is_first = np.ones(len(points), dtype=bool)
    is_first[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    return np.sort(order[is_first])


def scales(points: Array) -> tuple[float, float]:
    """Returns two lengths of distinct points `[n, d]`, L: the root mean square distance to the centroid, and h₄.

    h₄ is the median over the points of the mean distance to the 4 nearest others. Both are 1 for one point alone, which
    has no scale, as in the service.
    """
    if len(points) < 2:
        return 1.0, 1.0
    count = min(5, len(points))
    distances, _ = cKDTree(points).query(points, count)
    means = np.sort(np.reshape(distances, (len(points), count))[:, 1:].mean(axis=1))
    extent = np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean())
    return float(extent), float(means[len(means) // 2])
