"""What a cloud as a whole decides, found before it is cut: its extent, its samples, its cells and its coarse cloud."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import dask
import dask.array as da
import numpy as np

from ...wire.tensors import Array
from .cut import Cut, Ints
from .parts import Part, Reach, join, nearest
from .thinning import distinct, n_coarse, thinned

MAX_SAMPLE = 2_000_000
"""Points that cells and coarse cloud are chosen from, at most: as many as a server takes in one request."""

N_SITES = 96
"""Sites of a large cloud, or one more; a small one has up to 191, and the service takes 192 at most."""

PROBE_POINTS = 60_000
"""Points of the cloud that is asked what all learn, at most; one of no more is asked itself."""

REGRESSED = {2: 16, 3: 30, 4: 50}
"""Positions that a regression sees at most, by dimension."""

AROUND_SITES = PROBE_POINTS // N_SITES
"""Positions known around each site of a larger cloud, unless regressions reach farther."""

N_CENTRES = 16
TOGETHER = 16
"""Groups of points, and points of each, that a kernel is learned from."""


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
        The points at which tiles learn.
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
        sites, rows = np.arange(0, n, max(n // N_SITES, 1)), sampled(n)
        at_sites, *found = dask.compute(
            points[sites], *[dask.delayed(_looked_at)(block, first, rows) for block, first in blocks_of(points)]
        )
        extremes, sample = join([ends for ends, _ in found]), join([some for _, some in found])
        chosen = thinned(sample.points, n_coarse(n))
        centres = sample.points[thinned(sample.points, N_CENTRES)]
        of_sites = Reach(AROUND_SITES) if n > PROBE_POINTS else Reach(n, are_distinct=False)
        around, learning = _nearest(points, [(at_sites, of_sites), (centres, Reach(TOGETHER, are_distinct=False))])
        return cls(
            n_points=n,
            dimension=dimension,
            cut=Cut.of(sample.points, n_tiles),
            coarse=sample[chosen[distinct(sample.points[chosen])]],
            sites=Part(sites, at_sites),
            around=around,
            extremes=extremes[np.unique(_ends(extremes.points))],
            learning=learning,
        )

    def reaching(self, points: da.Array, count: int) -> Plan:
        """Returns one that knows so many positions around each site; looks at all points again if it has less."""
        if self.n_points <= PROBE_POINTS or count <= AROUND_SITES:
            return self
        (around,) = _nearest(points, [(self.sites.points, Reach(count))])
        return replace(self, around=around)

    def around_sites(self, count: int) -> Part:
        """Returns the sites with the points of the `count` positions that are nearest to each."""
        positions = self.positions()
        return join([self.sites, positions[nearest(positions, self.sites.points, Reach(count))]])

    def positions(self) -> Part:
        """Returns the points around the sites, one for each position."""
        return self.around[distinct(self.around.points)]


def blocks_of(array: da.Array) -> list[tuple[Any, int]]:
    """Returns the blocks of rows of an array as delayed objects, each with the number of its first row."""
    firsts = np.concatenate([[0], np.cumsum(array.chunks[0])[:-1]]).tolist()
    return list(zip(array.to_delayed().reshape(-1), firsts, strict=True))


def _ends(points: Array) -> Ints:
    return np.concatenate([points.argmin(axis=0), points.argmax(axis=0)])


def sampled(n_points: int) -> Ints:
    """Returns the rows that cells and coarse cloud are chosen from: all, or one of each so many, at random.

    Of the others each would be as far from the last, and scans have their lines as far apart.
    """
    step = -(-n_points // MAX_SAMPLE)
    firsts = np.arange(0, n_points, step)
    return firsts + np.random.default_rng(0).integers(np.minimum(step, n_points - firsts))


def _looked_at(block: Array, first: int, sample: Ints) -> tuple[Part, Part]:
    """Returns the points of a block that span its bounding box, and those with these rows in the cloud."""
    part = Part(np.arange(first, first + len(block)), block)
    start, end = np.searchsorted(sample, [first, first + len(block)]).tolist()
    return part[np.unique(_ends(block)) if len(block) else np.arange(0)], part[sample[start:end] - first]


def _nearest(points: da.Array, wanted: list[tuple[Array, Reach]]) -> list[Part]:
    """Returns the points that are nearest to some places, for each pair of these and how many of them count."""
    found = dask.compute(*[dask.delayed(_near)(block, first, wanted) for block, first in blocks_of(points)])
    parts = [join([of_block[at] for of_block in found]) for at in range(len(wanted))]
    return [part[nearest(part, places, reach)] for part, (places, reach) in zip(parts, wanted, strict=True)]


def _near(block: Array, first: int, wanted: list[tuple[Array, Reach]]) -> list[Part]:
    """Returns those of a block."""
    part = Part(np.arange(first, first + len(block)), block)
    candidates = [reach.candidates(part) for _, reach in wanted]
    return [those[nearest(those, places, reach)] for those, (places, reach) in zip(candidates, wanted, strict=True)]
