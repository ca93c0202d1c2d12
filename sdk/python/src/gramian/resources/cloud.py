"""Clouds and their operations."""

from __future__ import annotations

from .batches import BatchesOnCloud
from .operators import OperatorsOnCloud
from .selection import SelectionOnCloud
from .surface import SurfaceOfCloud
from .values import ValuesOfCloud


class Cloud(ValuesOfCloud, BatchesOnCloud, SelectionOnCloud, SurfaceOfCloud, OperatorsOnCloud):
    """Points that the service keeps under an id, with a method for each operation on them.

    The id is a hash of the points (and normals, if given), so it is the same whenever and wherever they are
    posted. The service forgets the least recently used clouds. A cloud made from points or a file keeps a
    copy of them, and posts them again when an operation finds them forgotten. A cloud listed by
    `Client.clouds()` has no copy, and raises `UnknownCloud` instead.

    `gramian.arguments.normalise` describes what methods accept: numbers of NumPy are numbers, arrays may be
    lists or data frames, words may be members of enumerations, and None means absent. The client refuses
    wrong types, shapes and numbers, as `TypeError` and `ValueError` with the name of the argument. The
    service refuses everything else, as `Problem`.

    A cloud does not change, and several threads may use it. It belongs to its client and cannot be pickled.
    Its points and its answers can.
    """
