"""Signs that make the normals of all tiles consistent, by the rules of the service for a whole cloud.

As in src/numerics/surface/orientation.rs: neighbours whose signs agree are joined to regions, and regions by what their
common borders say, surest first. Each tile finds the regions of its own points (`Regions`), a few numbers for each, and
all of them together are joined in one place (`joined`): points in the halo of a tile link its regions to others. What a
connected piece has for a side, which the service decides by the shape of the cloud, the normals of the coarse cloud say
here, by vote.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from ..tensors import Array
from .cut import Ints
from .thinning import distinct

SAYS_SIGN = 0.2
SAME_REGION = 0.7
RESOLVED = 0.2
CONTRADICTION = 0.1
LEAST_WEIGHT = 0.01


@dataclass(frozen=True)
class Edges:
    """From points to neighbours on one sheet: `a`, `b` `[e]`, cosines of their normals, weights, 1 for the surest."""

    a: Ints
    b: Ints
    cosines: Array
    weights: Array

    @classmethod
    def of(cls, points: Array, normals: Array, own: Ints) -> Edges:
        """Looks at the nearest positions around own points; normals `[n, d]` are zero where there is none."""
        count = min(2 * points.shape[1] + 3, len(firsts := distinct(points)))
        distances, rows = cKDTree(points[firsts]).query(points[own], count)
        a = np.repeat(own, count)
        b, distances = firsts[np.reshape(rows, -1)], np.reshape(distances, -1)
        a, b, distances = a[distances > 0], b[distances > 0], distances[distances > 0]
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
    votes
        `[r]`. Of the coarse cloud, positive for the sides that normals have.
    n_signed
        `[r]`. Own points where the coarse function says much of the side.
    n_wanted
        Edges that own points would have on a surface that is sampled well.
    """

    halo: Ints
    halo_labels: Ints
    pairs: Ints
    agreeing: Array
    opposing: Array
    votes: Array
    n_signed: Array
    n_wanted: int

    @classmethod
    def of(
        cls, index: Ints, points: Array, normals: Array, outward: Array, own: Ints, coarse: tuple[Ints, Array]
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
        coarse : `[c]`, `[c, d]`
            Rows in the cloud of the points of the coarse cloud, and their normals.
        """
        n = len(points)
        if len(own) == 0:
            return np.zeros(n, dtype=np.int64), _nothing()
        has_sign = np.abs((normals * outward).sum(axis=1)) > SAYS_SIGN
        edges = Edges.of(points, normals, own)
        alike = has_sign[edges.a] & has_sign[edges.b] & (edges.cosines > SAME_REGION)
        graph = _graph(edges.a[alike], edges.b[alike], np.ones(int(alike.sum())), n)
        count, labels = connected_components(graph, directed=False)
        a, b = labels[edges.a].astype(np.int64), labels[edges.b].astype(np.int64)
        codes, places = np.unique(np.minimum(a, b) * count + np.maximum(a, b), return_inverse=True)
        _, rows, at = np.intersect1d(index[own], coarse[0], return_indices=True)
        rows = own[rows]
        is_halo = np.ones(n, dtype=bool)
        is_halo[own] = False
        regions = cls(
            halo=index[is_halo],
            halo_labels=labels[is_halo],
            pairs=np.column_stack([codes // count, codes % count]),
            agreeing=_sums(places, edges.weights * (edges.cosines >= 0), len(codes)),
            opposing=_sums(places, edges.weights * (edges.cosines < 0), len(codes)),
            votes=_sums(labels[rows], (normals[rows] * coarse[1][at]).sum(axis=1), count),
            n_signed=_sums(labels[own], has_sign[own], count),
            n_wanted=len(own) * (2 * points.shape[1] + 2),
        )
        return labels, regions


def _nothing() -> Regions:
    """Returns what a cell without points says."""
    rows, numbers = np.empty(0, dtype=np.int64), np.empty(0)
    return Regions(rows, rows, np.empty((0, 2), dtype=np.int64), numbers, numbers, numbers, numbers, 0)


def joined(regions: Sequence[Regions], shared: Sequence[tuple[Ints, Ints]]) -> list[Array]:
    """Returns the signs of the regions of each tile, `[r]`, each 1 or −1.

    Parameters
    ----------
    regions : sequence of Regions
        Of each tile.
    shared : sequence of (`[s]`, `[s]`)
        Of each tile the rows in the cloud of those of its points that are in halos of others, and their regions.
    """
    firsts = np.concatenate([[0], np.cumsum([len(of_tile.votes) for of_tile in regions])]).astype(np.int64)
    owned, owners = _numbered(shared, firsts)
    halo, guests = _numbered([(of_tile.halo, of_tile.halo_labels) for of_tile in regions], firsts)
    order = np.argsort(owned)
    hosts = owners[order][np.searchsorted(owned, halo, sorter=order)] if len(halo) else guests
    count, numbers = connected_components(_graph(guests, hosts, np.ones(len(halo)), int(firsts[-1])), directed=False)
    pairs = np.concatenate(
        [numbers[of_tile.pairs + first] for of_tile, first in zip(regions, firsts[:-1], strict=True)]
    )
    agreeing = np.concatenate([of_tile.agreeing for of_tile in regions])
    opposing = np.concatenate([of_tile.opposing for of_tile in regions])
    total = float((agreeing + opposing).sum())
    signs = np.ones(count)
    if total >= RESOLVED * sum(of_tile.n_wanted for of_tile in regions):
        votes = _sums(numbers, np.concatenate([of_tile.votes for of_tile in regions]), count)
        n_signed = _sums(numbers, np.concatenate([of_tile.n_signed for of_tile in regions]), count)
        signs = _signs(pairs, agreeing - opposing, votes, n_signed)
        together = signs[pairs[:, 0]] * signs[pairs[:, 1]] > 0
        if np.where(together, opposing, agreeing).sum() > CONTRADICTION * total:
            signs = np.where(n_signed > 0, 1.0, signs)
    return [signs[numbers[first:last]] for first, last in pairwise(firsts.tolist())]


def _numbered(labels: Sequence[tuple[Ints, Ints]], firsts: Ints) -> tuple[Ints, Ints]:
    """Returns all rows with their regions, those of all tiles counted on."""
    numbers = [of_tile + first for (_, of_tile), first in zip(labels, firsts[:-1], strict=True)]
    return np.concatenate([rows for rows, _ in labels]), np.concatenate(numbers)


def _signs(pairs: Ints, weights: Array, votes: Array, n_signed: Array) -> Array:
    """Joins regions to pieces across their surest borders, and gives each the side of its votes."""
    count = len(votes)
    apart = pairs[:, 0] != pairs[:, 1]
    a, b = np.sort(pairs[apart], axis=1).T
    borders = _graph(a, b, weights[apart], count)
    borders.eliminate_zeros()
    lengths = borders.copy()
    lengths.data = 1 + np.abs(borders.data).max(initial=0) - np.abs(borders.data)
    tree = minimum_spanning_tree(lengths).tocoo()
    up, down = tree.row, tree.col
    agree = np.asarray(borders[up, down]).reshape(-1) > 0 if tree.nnz else np.zeros(0, dtype=bool)
    # Every region twice, once for each sign: what is joined has signs that go together.
    first = np.concatenate([up, up + count])
    second = np.concatenate([np.where(agree, down, down + count), np.where(agree, down + count, down)])
    _, halves = connected_components(_graph(first, second, np.ones(len(first)), 2 * count), directed=False)
    pieces = np.minimum(halves[:count], halves[count:])
    relative = np.where(halves[:count] == pieces, 1.0, -1.0)
    of_coarse = _sums(pieces, relative * votes, 2 * count)
    of_function = _sums(pieces, relative * n_signed, 2 * count)
    sides = np.where(of_coarse != 0, of_coarse, of_function)
    signs: Array = relative * np.where(sides < 0, -1.0, 1.0)[pieces]
    return signs


def _graph(a: Ints, b: Ints, weights: Array, count: int) -> csr_matrix:
    return coo_matrix((weights, (a, b)), shape=(count, count)).tocsr()


def _sums(places: Ints, weights: Array, count: int) -> Array:
    """Adds up weights by place, `[count]`."""
    return np.bincount(places, weights, count).astype(np.float64)
