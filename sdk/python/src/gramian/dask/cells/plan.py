"""What is looked at in a cloud before it is cut: its extent, a sample, and its cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import dask
import dask.array as da
import numpy as np

from ...wire.tensors import Array
from .cut import Cut, Ints
from .parts import Part, Reach, join, nearest

MAX_SAMPLE = 2_000_000
"""Most points from which cells and coarse cloud are chosen: as many as a server takes in one request."""

N_SITES = 96
"""Sites of a large cloud, or one more. A small cloud has up to 191, and the service takes 192 at most."""


@dataclass(frozen=True)
class Plan:
    """What tiles share."""

    n_points: int  # n
    dimension: int  # d
    cut: Cut  # a cell for each tile
    sample: Part  # all points, or some of a large cloud, chosen evenly
    sites: Part  # points around which tiles learn
    extremes: Part  # points that span the bounding box

    @classmethod
    def of(cls, points: da.Array, n_tiles: int) -> Plan:
        """Looks once at all points of an array `[n, d]` with known blocks of rows, on Dask's scheduler."""
        n, dimension = points.shape
        sites, rows = np.arange(0, n, max(n // N_SITES, 1)), sampled(n)
        at_sites, *found = dask.compute(
            points[sites], *[dask.delayed(_looked_at)(block, first, rows) for block, first in blocks_of(points)]
        )
        extremes, sample = join([ends for ends, _ in found]), join([some for _, some in found])
        corners = extremes[np.unique(_ends(extremes.points))]
        return cls(n, dimension, Cut.of(sample.points, n_tiles), sample, Part(sites, at_sites), corners)


def blocks_of(array: da.Array) -> list[tuple[Any, int]]:
    """Returns the blocks of rows of an array, delayed, each with the number of its first row."""
    firsts = np.concatenate([[0], np.cumsum(array.chunks[0])[:-1]]).tolist()
    return list(zip(array.to_delayed().reshape(-1), firsts, strict=True))


def nearest_to(places: Array, points: da.Array, reach: Reach) -> Part:
    """Looks at all points for those nearest to some places `[m, d]`."""
    found = dask.compute(*[dask.delayed(_near)(block, first, places, reach) for block, first in blocks_of(points)])
    part = join(found)
    return part[nearest(part, places, reach)]


def sampled(n_points: int) -> Ints:
    """Returns the rows of the sample: all, or one of every so many, at random.

    If each were as far from the last, they would follow the lines of a scan, which are equally far apart.
    """
    step = -(-n_points // MAX_SAMPLE)
    firsts = np.arange(0, n_points, step)
    return firsts + np.random.default_rng(0).integers(np.minimum(step, n_points - firsts))


def _ends(points: Array) -> Ints:
    return np.concatenate([points.argmin(axis=0), points.argmax(axis=0)])


def _looked_at(block: Array, first: int, sample: Ints) -> tuple[Part, Part]:
    """Returns the points of a block that span its bounding box, and those of the sample."""
    part = Part(np.arange(first, first + len(block)), block)
    start, end = np.searchsorted(sample, [first, first + len(block)]).tolist()
    return part[np.unique(_ends(block)) if len(block) else np.arange(0)], part[sample[start:end] - first]


def _near(block: Array, first: int, places: Array, reach: Reach) -> Part:
    candidates = reach.candidates(Part(np.arange(first, first + len(block)), block))
    return candidates[nearest(candidates, places, reach)]
