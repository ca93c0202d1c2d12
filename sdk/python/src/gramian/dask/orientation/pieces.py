"""The sides of connected pieces of a surface, by the rule of the service in numerics/src/surface/orientation/.

A bulky piece that is in no other has the side that gives it a positive volume. So has one where the coarse function
does not agree with itself; for all others it decides. Rims, which tiles do not know of, are not looked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...wire.tensors import Array
from ..cells.cut import Ints
from ..cells.plan import REGRESSED
from .measures import Measures, Truths, means, sums

UNANIMITY = 0.95
BULKY = 0.1
LOST_VOLUME = 1.05
LOCAL_CONTRADICTION = 0.02
LARGE = 0.01
"""Share of all points above which a piece may have others in it."""

RESOLVED_BY = 10
"""Points of the coarse cloud from which on its function is taken to know a piece. See tests: of spheres with 3 it turns
a third inside out, of those with 10 none."""


@dataclass(frozen=True)
class Pieces:
    """Connected pieces.

    Attributes
    ----------
    labels
        `[r]`. The piece of each region.
    relative
        `[r]`. Signs of the regions, relative to one another within each piece.
    has_sign
        `[r]`. Whether the coarse function says something of the side of a region.
    measures
        Those of the regions.
    """

    labels: Ints
    relative: Array
    has_sign: Truths
    measures: Measures

    @property
    def count(self) -> int:
        """The number of pieces."""
        return int(self.labels.max(initial=-1)) + 1

    def sides(self) -> tuple[Array, Truths]:
        """Returns the sign of each piece, and whether that is doubtful: nearly a matter of chance."""
        areas = self.measures.areas * self.has_sign
        totals, votes = self._sum(areas), self._sum(areas * self.relative)
        volumes = self._sum(self.relative * self._volumes())
        is_bulky = ~self._is_nested() & (np.abs(volumes) > BULKY * self._balls())
        is_unanimous = (totals > 0) & (np.abs(votes) >= (2 * UNANIMITY - 1) * totals)
        decisive = np.where(is_unanimous & ~is_bulky | (volumes == 0), votes, volumes)
        is_known = is_bulky | is_unanimous & self.are_resolved()
        # What has no more points than one regression sees lies on another piece, which the function knows.
        is_large = self._sum(self.measures.n_points) > REGRESSED[self.measures.centres.shape[1]]
        return np.where(decisive < 0, -1.0, 1.0), ~is_known & is_large

    def are_resolved(self) -> Truths:
        """Says of which pieces the coarse cloud has so much that its function knows their sides, `[p]`."""
        resolved: Truths = self._sum(self.measures.n_coarse) >= RESOLVED_BY
        return resolved

    def are_several(self, opposing: Array, total: Array) -> Truths:
        """Says which pieces lose volume by signs that go together, and so are several surfaces that nearly touch.

        They have more by the function alone, which contradicts itself across few of their edges: `opposing` of `total`,
        `[p]`, by weight.
        """
        volumes = self._volumes() * self.has_sign
        alone, together = np.abs(self._sum(volumes)), np.abs(self._sum(self.relative * volumes))
        agrees = opposing <= LOCAL_CONTRADICTION * total
        several: Truths = agrees & (alone > LOST_VOLUME * together) & (self.measures.centres.shape[1] > 2)
        return several

    def _sum(self, numbers: Array) -> Array:
        return sums(self.labels, numbers, self.count)

    def _arms(self) -> Array:
        """From the centre of the piece to that of each region, `[r, d]`, L."""
        measures = self.measures
        return measures.centres - means(self.labels, measures.centres, measures.areas, self.count)[self.labels]

    def _volumes(self) -> Array:
        """Σa(x − c)·ν of each region about the centre of its piece."""
        volumes: Array = self.measures.volumes + (self._arms() * self.measures.normals).sum(axis=1)
        return volumes

    def _balls(self) -> Array:
        """Σa|x − c| of each piece, or a little more: |x − c| is averaged by its square within each region."""
        measures = self.measures
        squares = measures.spreads + measures.areas * (self._arms() ** 2).sum(axis=1)
        return self._sum(np.sqrt(measures.areas * squares))

    def _is_nested(self) -> Truths:
        """Says which pieces are in the box of another one, a large one."""
        lower, upper = np.full((2, self.count, self.measures.lower.shape[1]), np.inf)
        np.minimum.at(lower, self.labels, self.measures.lower)
        np.minimum.at(upper, self.labels, -self.measures.upper)
        n_points = self._sum(self.measures.n_points)
        is_nested = np.zeros(self.count, dtype=bool)
        for large in np.flatnonzero(n_points >= LARGE * n_points.sum()):
            is_nested |= (lower > lower[large]).all(axis=1) & (upper > upper[large]).all(axis=1)
        return is_nested
