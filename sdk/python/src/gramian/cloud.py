"""Clouds and what can be asked about them."""

from __future__ import annotations

from .resources.batches import BatchesOnCloud
from .resources.operators import OperatorsOnCloud
from .resources.selection import SelectionOnCloud
from .resources.surface import SurfaceOfCloud
from .resources.values import ValuesOfCloud


class Cloud(ValuesOfCloud, BatchesOnCloud, SelectionOnCloud, SurfaceOfCloud, OperatorsOnCloud):
    """Points that the service keeps under an id, and what can be asked about them.

    The id is a hash of the points (and normals, if given), so it is the same whenever and wherever they are posted. The
    service forgets the clouds that were not used for longest. A cloud that was made from points or a file has a copy of
    them, and posts them again when an operation finds them forgotten; one that was listed by `Client.clouds()` has
    none, and raises `UnknownCloud` instead.

    `gramian.normalise` describes what methods accept: numbers of NumPy are numbers, arrays may be lists or data frames,
    words may be members of enumerations, and None is as absent. Wrong types, shapes and numbers are refused here, as
    `TypeError` and `ValueError` with the name of the argument; all else is refused by the service, as `Problem`.

    A cloud does not change, and may be used by several threads. It belongs to its client and cannot be pickled; its
    points and its answers can.
    """
