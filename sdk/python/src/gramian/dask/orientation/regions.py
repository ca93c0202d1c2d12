"""Regions of a tile, in which the normals of neighbours agree.

As in numerics/src/surface/orientation/; what that does with the regions of a cloud is in `signs`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...wire.tensors import Array
from ..cells.cut import Ints
from ..cells.thinning import distinct
from .measures import SPACING_NEIGHBOURS, Measures, sums

SAYS_SIGN = 0.2
SAME_REGION = 0.7
LEAST_WEIGHT = 0.01


@dataclass(frozen=True)
class Around:
    """The nearest positions elsewhere: `rows` `[m, k]` around own points, nearest first, at `distances`, L."""

    own: Ints
    rows: Ints
    distances: Array

    @classmethod
    def of(cls, points: Array, own: Ints) -> Around:
        """Looks at as many as an own point shares edges with; fewer if there are no more."""
        count = min(2 * points.shape[1] + 3, len(firsts := distinct(points)))
        distances, rows = cKDTree(points[firsts]).query(points[own], count)
        shape = len(own), count
        return cls(own, firsts[np.reshape(rows, shape)[:, 1:]], np.reshape(distances, shape)[:, 1:])

    @property
    def spacings(self) -> Array:
        """Mean distances to the 4 nearest, `[m]`, L; 0 if there is no other position."""
        nearest = self.distances[:, :SPACING_NEIGHBOURS]
        spacings: Array = nearest.sum(axis=1) / max(nearest.shape[1], 1)
        return spacings


@dataclass(frozen=True)
class Edges:
    """From points to neighbours on one sheet: `a`, `b` `[e]`, cosines of their normals, weights, 1 for the surest."""

    a: Ints
    b: Ints
    cosines: Array
    weights: Array

    @classmethod
    def of(cls, points: Array, normals: Array, around: Around) -> Edges:
        """Looks at the nearest positions around own points; normals `[n, d]` are zero where there is none."""
        a = np.repeat(around.own, around.rows.shape[1])
        b, distances = around.rows.reshape(-1), around.distances.reshape(-1)
        steps = points[b] - points[a]
        cosines = (normals[a] * normals[b]).sum(axis=1)
        across = np.abs((steps * (normals[a] + np.sign(cosines)[:, None] * normals[b])).sum(axis=1))
        weights = cosines**2 * (1 - 2 * across / distances)
        kept = weights > LEAST_WEIGHT
        return cls(a[kept], b[kept], cosines[kept], weights[kept])


@dataclass(frozen=True)
class Regions:
    """Regions of a tile, and what it knows of them by its own points.

    Attributes
    ----------
    halo, halo_labels
        `[h]`. Rows in the cloud of the points of the halo, and their regions.
    pairs
        `[p, 2]`. Regions with neighbouring points, also those with themselves.
    agreeing, opposing
        `[p]`. Sums of the weights of the edges between them whose normals agree, and do not.
    measures
        Sums over own points.
    n_wanted
        Edges that own points would have on a surface that is sampled well.
    """

    halo: Ints
    halo_labels: Ints
    pairs: Ints
    agreeing: Array
    opposing: Array
    measures: Measures
    n_wanted: int

    @classmethod
    def of(
        cls, index: Ints, points: Array, normals: Array, outward: Array, own: Ints, coarse: Ints
    ) -> tuple[Ints, Regions]:
        """Finds them; the first result is the region of each point, `[n]`.

        Parameters
        ----------
        index : `[n]`
            Rows in the cloud of the points of the cell and its halo.
        points : `[n, d]`
            L.
        normals : `[n, d]`
            Unit vectors on the side of `outward`; zero where there is none.
        outward : `[n, d]`
            Unit vectors, outward by the coarse function.
        own : `[m]`
            Places of the points of the cell.
        coarse : `[c]`
            Rows in the cloud of the points of the coarse cloud.
        """
        n = len(points)
        if len(own) == 0:
            return np.zeros(n, dtype=np.int64), _nothing(points.shape[1])
        has_sign = np.abs((normals * outward).sum(axis=1)) > SAYS_SIGN
        around = Around.of(points, own)
        edges = Edges.of(points, normals, around)
        alike = has_sign[edges.a] & has_sign[edges.b] & (edges.cosines > SAME_REGION)
        count, labels = connected_components(graph_of(edges.a[alike], edges.b[alike], n), directed=False)
        a, b = labels[edges.a].astype(np.int64), labels[edges.b].astype(np.int64)
        codes, places = np.unique(np.minimum(a, b) * count + np.maximum(a, b), return_inverse=True)
        is_halo = np.ones(n, dtype=bool)
        is_halo[own] = False
        areas, is_coarse = around.spacings ** (points.shape[1] - 1), np.isin(index[own], coarse)
        of_own = (labels[own], count), points[own], normals[own]
        regions = cls(
            halo=index[is_halo],
            halo_labels=labels[is_halo],
            pairs=np.column_stack([codes // count, codes % count]),
            agreeing=sums(places, edges.weights * (edges.cosines >= 0), len(codes)),
            opposing=sums(places, edges.weights * (edges.cosines < 0), len(codes)),
            measures=Measures.of(*of_own, areas, has_sign[own], is_coarse),
            n_wanted=len(own) * (2 * points.shape[1] + 2),
        )
        return labels, regions


def graph_of(a: Ints, b: Ints, count: int, weights: Array | None = None) -> csr_matrix:
    """Returns the matrix of a graph with these edges, of weight 1 if nothing is said."""
    return coo_matrix((np.ones(len(a)) if weights is None else weights, (a, b)), shape=(count, count)).tocsr()


def _nothing(dimension: int) -> Regions:
    """Returns what a cell without points says."""
    rows, numbers, points = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, dimension))
    measures = Measures.of((rows, 0), points, points, numbers, numbers > 0, numbers > 0)
    return Regions(rows, rows, np.empty((0, 2), dtype=np.int64), numbers, numbers, measures, 0)
