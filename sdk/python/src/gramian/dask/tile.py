"""Tiles: the points of a cell, those around it that its answers depend on, and what the service decides by.

Local regressions learn how noise relates to shape at sites, some points of the cloud. So that a tile learns the same,
it has the neighbourhoods of all of them, and tells the service where they are. The bounding box, beside which surfaces
count as flat, is that of the cloud by the points that span it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..wire.tensors import Array
from .cells.cut import Ints
from .cells.parts import Part, join


@dataclass(frozen=True)
class Tile:
    """A cloud that answers for the points of one cell as the whole cloud would.

    Attributes
    ----------
    number
        That of the cell.
    index
        `[n]`, ascending. Rows of the points in the cloud.
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


def assemble(number: int, core: Part, rims: Sequence[Part], carried: Part) -> Tile:
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
        What all tiles have.
    """
    near = join([core, *rims])
    return _of(number, join([near, carried]), core.index, near.index)


def widened(tile: Tile, carried: Part) -> Tile:
    """Returns a tile that carries more."""
    whole = join([Part(tile.index, tile.points), carried])
    return _of(tile.number, whole, tile.rows, tile.index[tile.is_near])


def _of(number: int, whole: Part, own: Ints, near: Ints) -> Tile:
    """Returns the tile of these points, with the rows of its cell and of those near it."""
    return Tile(number, whole.index, whole.points, np.searchsorted(whole.index, own), np.isin(whole.index, near))
