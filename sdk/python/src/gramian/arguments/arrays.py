"""Conversion of arrays to what is sent: the expected shape, float64, finite. Nothing is changed silently."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Mapping, Sequence, Set, Sized
from decimal import Decimal
from numbers import Real
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ..wire.tensors import Array
from .geometries import positions_of

Sizes: TypeAlias = Mapping[str, int]
"""Known lengths of axes, by name: n points, d coordinates."""

AnyArray: TypeAlias = npt.NDArray[Any]

NUMBERS = {
    "n": "one number for each point of the cloud",
    "d": "one number for each axis",
    "bounds": "the least and the greatest",
}
"""Meaning of the numbers of an array with one axis, by the name of the axis."""

ONE_FOR_ALL = {"noise_variances": "alpha", "length_scales": "length_scale"}
"""Fields that take one number for all, by the field that takes many."""

ROWS = {"points": "points", "queries": "points", "sites": "points", "normals": "normals", "values": "lists of values"}
"""Meaning of the rows of an array with two axes, by field."""

KINDS = {"c": "complex numbers", "b": "truth values", "S": "bytes", "U": "text", "M": "dates", "m": "durations"}
"""Names of the NumPy kinds that cannot be sent."""

REMEDIES = {
    "c": "send {name}.real and {name}.imag, one after the other",
    "b": "{name}.astype(float) makes 0 and 1 of them",
    "V": "numpy.lib.recfunctions.structured_to_unstructured makes columns of its fields",
}


def as_array(name: str, value: object, axes: Sequence[str], sizes: Sizes) -> Array:
    """Returns the numbers of an argument in the form that is sent.

    Copies them only if they must be converted.

    Parameters
    ----------
    name
        Name of the argument, for messages.
    value
        Lists, tuples, buffers, arrays, anything from which NumPy makes an array, such as data frames, and geometries.
    axes
        The names of the axes: `["n"]`, `["n", "d"]`.
    sizes
        The known lengths of axes, by name.

    Raises
    ------
    TypeError
        If it holds anything but real numbers.
    ValueError
        If it has another shape, or a number that is masked, not finite or not exact in float64.
    """
    found = read(name, value)
    _check_shape(name, found, axes, sizes)
    return _in_float64(name, found)


def as_block(name: str, value: object, first: int) -> Array:
    """Returns rows of a larger array in the form that is sent.

    Messages count rows from `first`, the number of the first of these rows.
    """
    return _in_float64(name, read(name, value, first), first)


def read(name: str, value: object, first: int = 0) -> AnyArray:
    """Returns the array that NumPy reads. Refuses entries that are masked or no real numbers."""
    value = positions_of(value)
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
    """Returns the array. Refuses it if an entry is masked, because no number may be used for that."""
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
    """Returns a message that names the first row whose length differs from that of row 0, or None."""
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
    """Converts to float64, rounding longer floats. Refuses inexact integers, infinity and NaN."""
    with np.errstate(over="ignore"):  # a long double out of range becomes infinite, and is refused below
        converted = np.asarray(array, dtype="<f8", order="C")
    if array.dtype.kind in "iu" and array.dtype.itemsize > 4:
        # A cast back is undefined beyond the largest integer. A number rounded up to there is certainly
        # inexact.
        beyond = converted >= 2.0 ** (8 * array.dtype.itemsize - (array.dtype.kind == "i"))
        back = np.where(beyond, 0, converted).astype(array.dtype)
        gaps = "which float64 does not have: beyond 2**53 it has gaps"
        _refuse_first(name, beyond | (back != array), array, gaps, first)
    _refuse_first(name, ~np.isfinite(converted), converted, "and only finite numbers can be sent", first)
    return converted


def _check_shape(name: str, array: AnyArray, axes: Sequence[str], sizes: Sizes) -> None:
    """Refuses wrong numbers of axes, wrong lengths, and arrays without entries."""
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
    """Returns the end of a message about a wrong shape: advice on what was probably meant."""
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
    """Refuses an array if it has bad entries. Names the first of them, with rows counted from `first`."""
    if bad.any():
        place = np.unravel_index(int(np.argmax(bad)), bad.shape)
        what = "masked" if array is None else array[place]
        at = [int(i) + (first if axis == 0 else 0) for axis, i in enumerate(place)]
        raise ValueError(f"{name}{at or ''} is {what}, {why}")
