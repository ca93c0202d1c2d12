"""Signs that make the normals of all tiles consistent, by the rules of the service for a whole cloud.

As in numerics/src/surface/orientation/: neighbours whose signs agree are joined to regions, and regions to pieces by
what their common borders say, surest first. Each tile finds the regions of its own points (`Regions`), a few numbers
for each, and all of them together are joined in one place (`joined`): points in the halo of a tile link its regions to
others. Sums over all points say which side a piece has (`Pieces`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from ...wire.tensors import Array
from ..cells.cut import Ints
from .measures import Measures, Truths, sums
from .pieces import Pieces
from .regions import Regions, graph_of

RESOLVED = 0.2
CONTRADICTION = 0.1


@dataclass(frozen=True)
class Sides:
    """Of the regions of a tile: their signs, 1 or −1, `[r]`, and whether these are doubtful, `[r]`."""

    signs: Array
    are_doubtful: Truths


@dataclass(frozen=True)
class _Borders:
    """Between regions, as in `Regions`."""

    pairs: Ints
    agreeing: Array
    opposing: Array

    @property
    def total(self) -> float:
        return float((self.agreeing + self.opposing).sum())

    def contradiction(self, signs: Array) -> float:
        """The weight of the edges across which normals with these signs are opposite."""
        together = signs[self.pairs[:, 0]] * signs[self.pairs[:, 1]] > 0
        return float(np.where(together, self.opposing, self.agreeing).sum())


def joined(regions: Sequence[Regions], shared: Sequence[tuple[Ints, Ints]]) -> list[Sides]:
    """Returns the sides of the regions of each tile.

    Parameters
    ----------
    regions : sequence of Regions
        Of each tile.
    shared : sequence of (`[s]`, `[s]`)
        Of each tile the rows in the cloud of those of its points that are in halos of others, and their regions.
    """
    firsts = np.concatenate([[0], np.cumsum([len(of_tile.measures) for of_tile in regions])]).astype(np.int64)
    numbers, count = _across_tiles(regions, shared, firsts)
    borders = _Borders(
        np.concatenate([numbers[of_tile.pairs + first] for of_tile, first in zip(regions, firsts[:-1], strict=True)]),
        np.concatenate([of_tile.agreeing for of_tile in regions]),
        np.concatenate([of_tile.opposing for of_tile in regions]),
    )
    measures = Measures.joined([of_tile.measures for of_tile in regions])
    has_sign = sums(numbers, measures.n_signed, count) > 0
    signs, are_doubtful = np.ones(count), np.zeros(count, dtype=bool)
    if borders.total >= RESOLVED * sum(of_tile.n_wanted for of_tile in regions):
        signs, are_doubtful = _signs(borders, numbers, has_sign, measures)
        if borders.contradiction(signs) > CONTRADICTION * borders.total:
            signs = np.where(has_sign, 1.0, signs)
    of_tiles = (numbers[first:last] for first, last in pairwise(firsts.tolist()))
    return [Sides(signs[of_tile], are_doubtful[of_tile]) for of_tile in of_tiles]


def _across_tiles(regions: Sequence[Regions], shared: Sequence[tuple[Ints, Ints]], firsts: Ints) -> tuple[Ints, int]:
    """Returns numbers for the regions of all tiles, the same for parts of one, and how many of these there are."""
    owned, owners = _numbered(shared, firsts)
    halo, guests = _numbered([(of_tile.halo, of_tile.halo_labels) for of_tile in regions], firsts)
    order = np.argsort(owned)
    hosts = owners[order][np.searchsorted(owned, halo, sorter=order)] if len(halo) else guests
    count, numbers = connected_components(graph_of(guests, hosts, int(firsts[-1])), directed=False)
    return numbers.astype(np.int64), count


def _numbered(labels: Sequence[tuple[Ints, Ints]], firsts: Ints) -> tuple[Ints, Ints]:
    """Returns all rows with their regions, those of all tiles counted on."""
    numbers = [of_tile + first for (_, of_tile), first in zip(labels, firsts[:-1], strict=True)]
    return np.concatenate([rows for rows, _ in labels]), np.concatenate(numbers)


def _signs(borders: _Borders, numbers: Ints, has_sign: Truths, measures: Measures) -> tuple[Array, Truths]:
    """Returns the sign of each region, and whether that is doubtful; `numbers` are those of the measures."""
    labels, relative = _joined_across(borders, len(has_sign))
    pieces = Pieces(labels[numbers], relative[numbers], has_sign[numbers], measures)
    sides, are_doubtful = pieces.sides()
    signed = has_sign[borders.pairs].all(axis=1)
    of_pairs = labels[borders.pairs[signed, 0]]
    opposing = sums(of_pairs, borders.opposing[signed], pieces.count)
    total = opposing + sums(of_pairs, borders.agreeing[signed], pieces.count)
    are_several = pieces.are_several(opposing, total)
    signs = np.where(are_several[labels] & has_sign, 1.0, relative * sides[labels])
    # Surfaces that nearly touch have the sides that the function says.
    are_doubtful = np.where(are_several, ~pieces.are_resolved(), are_doubtful)
    return signs, are_doubtful[labels]


def _joined_across(borders: _Borders, count: int) -> tuple[Ints, Array]:
    """Joins regions across their surest borders; returns the piece of each, and its sign relative to the others'."""
    apart = borders.pairs[:, 0] != borders.pairs[:, 1]
    a, b = np.sort(borders.pairs[apart], axis=1).T
    votes = graph_of(a, b, count, (borders.agreeing - borders.opposing)[apart])
    votes.eliminate_zeros()
    lengths = votes.copy()
    lengths.data = 1 + np.abs(votes.data).max(initial=0) - np.abs(votes.data)
    tree = minimum_spanning_tree(lengths).tocoo()
    up, down = tree.row, tree.col
    agree = np.asarray(votes[up, down]).reshape(-1) > 0 if tree.nnz else np.zeros(0, dtype=bool)
    # Every region twice, once for each sign: what is joined has signs that go together.
    first = np.concatenate([up, up + count])
    second = np.concatenate([np.where(agree, down, down + count), np.where(agree, down + count, down)])
    _, halves = connected_components(graph_of(first, second, 2 * count), directed=False)
    lesser = np.minimum(halves[:count], halves[count:])
    pieces = np.unique(lesser, return_inverse=True)[1].reshape(-1)
    return pieces, np.where(halves[:count] == lesser, 1.0, -1.0)
