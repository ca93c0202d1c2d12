"""Tiles: the points of a cell, those around it that its answers depend on, and what the service decides by.

Local regressions learn how noise relates to shape from the neighbourhoods of about 96 points, every (n/96)-th of the
cloud. So that a tile learns the same, it has all of these neighbourhoods, with the same points at every (n/96)-th place
of its own. The bounding box, beside which surfaces count as flat, is that of the cloud by the points that span it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..tensors import Array
from .cut import Ints
from .parts import Part, join
from .plan import N_SITES


@dataclass(frozen=True)
class Tile:
    """A cloud that answers for the points of one cell as the whole cloud would.

    Attributes
    ----------
    number
        That of the cell.
    index
        `[n]`. Rows of the points in the cloud.
    points
        `[n, d]`, L.
    own
        `[m]`. Places of the points of the cell, in the order of the cloud.
    is_near
        `[n]`. Whether a point is in the cell or its halo, and not only there for what all tiles share.
    """

    number: int
    index: Ints
    points: Array
    own: Ints
    is_near: npt.NDArray[np.bool_]

    @property
    def rows(self) -> Ints:
        """`[m]`, ascending. Rows in the cloud of what it answers for."""
        return self.index[self.own]


def assemble(
    number: int, core: Part, rims: Sequence[Part], carried: Part, sites: Ints, spare: Part, least: int = 0
) -> Tile:
    """Puts a tile together.

    Parameters
    ----------
    number : int
        That of the cell.
    core : Part
        The points of the cell.
    rims : sequence of Part
        Those of other cells that its answers depend on.
    carried : Part
        What all tiles have, the sites among them.
    sites : `[s]`
        Rows in the cloud of the points that are to be every (n/96)-th of the tile.
    spare : Part
        Points that may be added, for the tile to have a number of points with as many such places.
    least : int
        Points that it is to have, if there are so many.
    """
    near = join([core, *rims])
    return _arranged(number, join([near, carried]), (core.index, near.index), sites, spare, least)


def widened(tile: Tile, carried: Part, sites: Ints, spare: Part) -> Tile:
    """Returns a tile that carries more."""
    order = np.argsort(tile.index)
    whole = join([Part(tile.index[order], tile.points[order]), carried])
    return _arranged(tile.number, whole, (tile.rows, tile.index[tile.is_near]), sites, spare, 0)


def _arranged(number: int, whole: Part, members: tuple[Ints, Ints], sites: Ints, spare: Part, least: int) -> Tile:
    """Adds spare points, and puts the sites to their places; members are the rows of the cell, and those near it."""
    missing = _wanted(max(len(whole), least), len(sites)) - len(whole)
    if missing:
        others = spare[np.flatnonzero(~np.isin(spare.index, whole.index))]
        whole = join([whole, others[np.arange(min(missing, len(others)))]])
    order = _with_sites(whole, sites)
    index = whole.index[order]
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    own, near = members
    return Tile(number, index, whole.points[order], place[np.searchsorted(whole.index, own)], np.isin(index, near))


def _wanted(n_points: int, n_sites: int) -> int:
    """Returns the least number of points from this one on of which every (n/96)-th are so many."""
    candidates = range(n_points, n_points + 2 * N_SITES)
    return next((n for n in candidates if -(-n // max(n // N_SITES, 1)) == n_sites), n_points)


def _with_sites(whole: Part, sites: Ints) -> Ints:
    """Returns the rows in the order of the cloud, but for those of the sites, which are at every (n/96)-th place."""
    n = len(whole)
    places = np.arange(0, n, max(n // N_SITES, 1))
    rows = np.searchsorted(whole.index, sites)
    if len(places) != len(rows):  # no spare points were left; what is learned is then a little different
        return np.arange(n)
    order = np.empty(n, dtype=np.int64)
    is_site, is_place = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    is_site[rows], is_place[places] = True, True
    order[places], order[~is_place] = rows, np.flatnonzero(~is_site)
    return order
