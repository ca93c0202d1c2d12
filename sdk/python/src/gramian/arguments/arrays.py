"""Arrays as they are sent: of one shape, in float64, finite, and with nothing changed in silence on the way there."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Mapping, Sequence, Set, Sized
from decimal import Decimal
from numbers import Real
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ..wire.tensors import Array

Sizes: TypeAlias = Mapping[str, int]
"""The lengths that are known when a request is made: n of the points, d of their coordinates."""

AnyArray: TypeAlias = npt.NDArray[Any]

NUMBERS = {
    "n": "one number for each point of the cloud",
    "d": "one number for each axis",
    "bounds": "the least and the greatest",
}
"""What the numbers of an array with one axis are."""

ONE_FOR_ALL = {"noise_variances": "alpha", "length_scales": "length_scale"}
"""What takes one number where these take many."""

ROWS = {"points": "points", "queries": "points", "sites": "points", "normals": "normals", "values": "lists of values"}
"""What the rows of an array with two axes are."""

KINDS = {"c": "complex numbers", "b": "truth values", "S": "bytes", "U": "text", "M": "dates", "m": "durations"}
"""The kinds of NumPy that are not sent, in words."""

REMEDIES = {
    "c": "send {name}.real and {name}.imag, one after the other",
    "b": "{name}.astype(float) makes 0 and 1 of them",
    "V": "numpy.lib.recfunctions.structured_to_unstructured makes columns of its fields",
}


def as_array(name: str, value: object, axes: Sequence[str], sizes: Sizes) -> Array:
    """Returns the numbers of an argument as they are sent, without a copy if they are so already.

    Parameters
    ----------
    name
        Of the argument, for the messages.
    value
        Lists, tuples, buffers, arrays, and what NumPy makes arrays of, such as data frames.
    axes
        The names of the axes: `["n"]`, `["n", "d"]`.
    sizes
        The lengths of the axes, by name, as far as they are known.

    Raises
    ------
    TypeError
        If it holds something else than real numbers.
    ValueError
        If it has another shape, or a number that is masked, not finite or not exact in float64.
    """
    found = read(name, value)
    _check_shape(name, found, axes, sizes)
    return _in_float64(name, found)


def as_block(name: str, value: object, first: int) -> Array:
    """Returns some rows of an array as they are sent; the first of them, which messages count from, is row `first`."""
    return _in_float64(name, read(name, value, first), first)


def read(name: str, value: object, first: int = 0) -> AnyArray:
    """Returns the array that NumPy sees, of real numbers, none of them masked."""
    if isinstance(value, Mapping | Set | Iterator):
        raise TypeError(f"{name} is to be an array, not a {type(value).__name__}; list(…) makes one of its entries")
    array = _refuse_masked(name, value, first)
    if array.dtype.kind == "O":
        _refuse_objects(name, value, array, first)
    if array.dtype.kind not in "fiu":
        kind, dtype = KINDS.get(array.dtype.kind, "no plain numbers"), array.dtype
        remedy = REMEDIES.get(dtype.kind, "only real numbers can be sent")
        raise TypeError(f"{name} has {kind} ({dtype}); {remedy.format(name=name)}")
    return array


def _refuse_masked(name: str, value: object, first: int) -> AnyArray:
    """Returns the array if nothing in it is masked: what lies under a mask is no number to compute with."""
    rows = isinstance(value, list | tuple) and any(isinstance(row, np.ma.MaskedArray) for row in value)
    try:
        array = np.ma.array(value) if rows else np.asanyarray(value)
    except (OverflowError, RuntimeError, TypeError, ValueError) as error:
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(f"{name} cannot be read as an array: {_ragged(name, value) or error}") from error
    if isinstance(array, np.ma.MaskedArray):
        hint = f"and nothing can be sent for it; leave such rows out, or {name}.filled(…)"
        _refuse_first(name, np.ma.getmaskarray(array), None, hint, first)
    return np.asarray(array)


def _ragged(name: str, value: object) -> str | None:
    """Says which row has another length than the first, if one has."""
    if not isinstance(value, list | tuple) or not all(isinstance(row, Sized) for row in value):
        return None
    lengths = [len(row) for row in value]
    other = next((row for row, length in enumerate(lengths) if length != lengths[0]), None)
    if other is None:
        return None
    return f"{name}[0] has the length {lengths[0]}, {name}[{other}] the length {lengths[other]}"


def _refuse_objects(name: str, value: object, array: AnyArray, first: int) -> None:
    if array.ndim == 0:
        raise TypeError(f"{name} is to be an array of numbers, not of the type {type(value).__name__}")
    for place, entry in np.ndenumerate(array):
        if isinstance(entry, bool) or not isinstance(entry, Real | Decimal):
            at, kind = [first + place[0], *place[1:]], type(entry).__name__
            raise TypeError(f"{name}{at} is {reprlib.repr(entry)} ({kind}), and only numbers can be sent")
    raise TypeError(f"{name} is an array of Python objects; np.asarray({name}, dtype=float) makes numbers of them")


def _in_float64(name: str, array: AnyArray, first: int = 0) -> Array:
    """Widens floating-point numbers, rounds longer ones; refuses integers that float64 does not have, and infinity."""
    with np.errstate(over="ignore"):  # a long double out of range becomes infinite, and is refused as such
        converted = np.asarray(array, dtype="<f8", order="C")
    if array.dtype.kind in "iu" and array.dtype.itemsize > 4:
        # Beyond the largest integer a cast back has no meaning: what rounded up to that is not exact for sure.
        beyond = converted >= 2.0 ** (8 * array.dtype.itemsize - (array.dtype.kind == "i"))
        back = np.where(beyond, 0, converted).astype(array.dtype)
        gaps = "which float64 does not have: beyond 2**53 it has gaps"
        _refuse_first(name, beyond | (back != array), array, gaps, first)
    _refuse_first(name, ~np.isfinite(converted), converted, "and only finite numbers can be sent", first)
    return converted


def _check_shape(name: str, array: AnyArray, axes: Sequence[str], sizes: Sizes) -> None:
    """Refuses another number of axes, other lengths, and arrays without entries."""
    wanted = [sizes.get(axis) for axis in axes]
    fits = array.ndim == len(axes) and all(
        want is None or want == length for want, length in zip(wanted, array.shape, strict=True)
    )
    if fits and array.size:
        return
    known = [str(axis if length is None else length) for axis, length in zip(axes, wanted, strict=True)]
    shape = f"[{', '.join(axes)}]" + (f" = [{', '.join(known)}]" if known != list(axes) else "")
    raise ValueError(f"{name} must have the shape {shape}, not {list(array.shape)}{_advice(name, array, axes, wanted)}")


def _advice(name: str, array: AnyArray, axes: Sequence[str], wanted: Sequence[int | None]) -> str:
    """Says what may have been meant."""
    if array.size == 0:
        return ": it is empty"
    field = name.rpartition(".")[2]
    if len(wanted) == 1:
        if array.ndim < 2:
            one = ONE_FOR_ALL.get(field) if array.ndim == 0 else None
            one_for_all = f"; one for all of them is {one}" if one else ""
            return f": {NUMBERS[axes[0]]}{one_for_all}" if axes[0] in NUMBERS else ""
        return f"; np.ravel({name}) is flat" if max(array.shape) == array.size else ""
    rows = ROWS.get(field, "points")
    if array.ndim == 1:
        one = f"np.reshape({name}, (1, -1)) is one of {len(array)}"
        if axes[1] != "d":
            return f": rows are {rows}; {one}"
        one += " coordinates"
        line = f"np.reshape({name}, (-1, 1)) are {len(array)} on a line"
        likely = {1: line, len(array): one}.get(wanted[1] or 0, f"{line}, {one}")
        return f": rows are {rows}; {likely}"
    length, width = wanted
    transposed = array.ndim == 2 and width in (None, array.shape[0]) and length in (None, array.shape[1])
    return f": rows are {rows}" + (f"; it looks transposed, send {name}.T" if transposed else "")


def _refuse_first(name: str, bad: npt.NDArray[np.bool_], array: AnyArray | None, why: str, first: int = 0) -> None:
    """Refuses an array by the first of its bad entries; its rows are counted from `first`."""
    if bad.any():
        place = np.unravel_index(int(np.argmax(bad)), bad.shape)
        what = "masked" if array is None else array[place]
        at = [int(i) + (first if axis == 0 else 0) for axis, i in enumerate(place)]
        raise ValueError(f"{name}{at or ''} is {what}, {why}")
