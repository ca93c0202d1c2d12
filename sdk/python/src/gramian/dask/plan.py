"""What a cloud as a whole decides, found before it is cut: its extent, its samples, its cells and its coarse cloud."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import dask
import dask.array as da
import numpy as np

from ..tensors import Array
from .cut import Cut, Ints
from .parts import Part, Reach, checked, join, nearest
from .thinning import distinct, n_coarse, thinned

MAX_SAMPLE = 2_000_000
"""Points that cells and coarse cloud are chosen from, at most: as many as a server takes in one request."""

N_SITES = 96
"""Neighbourhoods, or one more, that local regressions learn from: src/numerics/patches/mod.rs."""

PROBE_POINTS = 60_000
"""Points of the cloud that is asked what all learn, at most; one of no more is asked itself."""

AROUND_SITES = PROBE_POINTS // N_SITES
"""Positions known around each site of a larger cloud."""

N_CENTRES = 16
TOGETHER = 16
"""Groups of points, and points of each, that a kernel is learned from: src/numerics/selection/sample.rs."""


@dataclass(frozen=True)
class Plan:
    """What tiles share.

    Attributes
    ----------
    n_points, dimension
        n and d of the cloud.
    cut
        The cells, one for each tile.
    coarse
        At most 6,000 points, no two of which coincide, that say which side is outward.
    sites
        The points whose neighbourhoods the service learns from: 96 or 97 of large clouds, up to 191 of small ones.
    around
        The points nearest to these, one for each position; all points of a small cloud.
    extremes
        The points that span the bounding box.
    learning
        At most 256 points whose values a kernel is learned from.
    """

    n_points: int
    dimension: int
    cut: Cut
    coarse: Part
    sites: Part
    around: Part
    extremes: Part
    learning: Part

    @classmethod
    def of(cls, points: da.Array, n_tiles: int) -> Plan:
        """Looks at all points of an array `[n, d]` with known blocks of rows, twice, on Dask's scheduler."""
        n, dimension = points.shape
        blocks = blocks_of(points)
        step = -(-n // MAX_SAMPLE)
        sites = np.arange(0, n, max(n // N_SITES, 1))
        sample, at_sites, *ends = dask.compute(
            points[::step], points[sites], *[dask.delayed(_extremes)(block, first) for block, first in blocks]
        )
        sample = np.ascontiguousarray(sample, dtype=np.float64)
        chosen = thinned(sample, n_coarse(n))
        coarse = chosen[distinct(sample[chosen])]
        centres = sample[thinned(sample, N_CENTRES)]
        of_sites = Reach(AROUND_SITES) if n > PROBE_POINTS else Reach(n, are_distinct=False)
        of_values = Reach(TOGETHER, are_distinct=False)
        near = dask.delayed(_near)
        found = dask.compute(*[near(block, first, at_sites, centres, of_sites, of_values) for block, first in blocks])
        around, learning = join([around for around, _ in found]), join([learning for _, learning in found])
        extremes = join(ends)
        return cls(
            n_points=n,
            dimension=dimension,
            cut=Cut.of(sample, n_tiles),
            coarse=Part(coarse * step, sample[coarse]),
            sites=Part(sites, at_sites),
            around=around[nearest(around, at_sites, of_sites)],
            extremes=extremes[np.unique(_ends(extremes.points))],
            learning=learning[nearest(learning, centres, of_values)],
        )

    def around_sites(self, count: int) -> Part:
        """Returns the sites with the points of the `count` positions that are nearest to each."""
        positions = self.positions()
        return join([self.sites, positions[nearest(positions, self.sites.points, Reach(count))]])

    @property
    def spare(self) -> Part:
        """Points that tiles may have beside what they need; all points of a small cloud."""
        return self.coarse if self.n_points > PROBE_POINTS else self.around

    def positions(self) -> Part:
        """Returns the points around the sites, one for each position."""
        return self.around[distinct(self.around.points)]


def blocks_of(array: da.Array) -> list[tuple[Any, int]]:
    """Returns the blocks of rows of an array as delayed objects, each with the number of its first row."""
    firsts = np.concatenate([[0], np.cumsum(array.chunks[0])[:-1]]).tolist()
    return list(zip(array.to_delayed().reshape(-1), firsts, strict=True))


def _ends(points: Array) -> Ints:
    return np.concatenate([points.argmin(axis=0), points.argmax(axis=0)])


def _extremes(block: Array, first: int) -> Part:
    block = checked(block, first)
    rows = np.unique(_ends(block)) if len(block) else np.arange(0)
    return Part(first + rows, block[rows])


def _near(
    block: Array, first: int, sites: Array, centres: Array, of_sites: Reach, of_values: Reach
) -> tuple[Part, Part]:
    """Returns the points of a block that are nearest to the sites, and to the centres."""
    part = Part(np.arange(first, first + len(block)), checked(block, first))
    positions = of_sites.candidates(part)
    return positions[nearest(positions, sites, of_sites)], part[nearest(part, centres, of_values)]
