"""Conversion of single numbers and words to what is sent."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from decimal import Decimal
from enum import Enum
from numbers import Rational, Real

import numpy as np


def as_number(name: str, value: object) -> float:
    """Returns a number in float64.

    Floating-point numbers are rounded to float64 if necessary. Exact numbers (integers, fractions, decimals)
    must be exact in float64 too.

    Raises
    ------
    TypeError
        If it is not one real number.
    ValueError
        If it is masked, not finite, or not exact.
    """
    value = unwrapped(name, value)
    if isinstance(value, np.integer):
        value = int(value)  # a NumPy integer would be rounded when compared with a float
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real | Decimal):
        raise TypeError(f"{name} is to be a number, not {_kind(value)}")
    try:
        number = float(value)
    except (OverflowError, ValueError) as error:  # of an integer, a fraction; of a decimal that signals
        raise ValueError(f"{name} is no finite number of float64") from error
    if not math.isfinite(number):
        raise ValueError(f"{name} is {value}, and only finite numbers can be sent")
    if isinstance(value, Rational | Decimal) and number != value:
        raise ValueError(f"{name} is {value!r}, which float64 has not exactly; float(…) rounds it")
    return number


def as_whole(name: str, value: object) -> int:
    """Returns a whole number. Floating-point numbers without a fraction are accepted.

    Raises
    ------
    TypeError
        If it is not one real number.
    ValueError
        If it has a fraction, or `as_number` refuses it.
    """
    number = as_number(name, value)
    if not number.is_integer():
        raise ValueError(f"{name} is to be a whole number, not {number}")
    return int(number)


def as_truth(name: str, value: object) -> bool:
    """Returns a truth value. Numbers are refused.

    Raises
    ------
    TypeError
        If it is not a truth value.
    """
    value = unwrapped(name, value)
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} is to be True or False, not {_kind(value)}")
    return bool(value)


def as_word(name: str, value: object, words: Iterable[str]) -> str:
    """Returns one of these words, given as a string or as a member of an enumeration.

    Raises
    ------
    TypeError
        If it is no word.
    ValueError
        If it is not one of these words.
    """
    value = unwrapped(name, value)
    word = value.value if isinstance(value, Enum) else value
    words = list(words)
    if not isinstance(word, str):
        raise TypeError(f"{name} is to be one of {', '.join(map(repr, words))}, not {_kind(value)}")
    if word not in words:
        known = ", ".join(map(repr, words))
        raise ValueError(f"{name} is {str(word)!r}, which is none of {known}{nearest(word, words)}")
    return str(word)


def as_words(name: str, value: object, words: Iterable[str]) -> list[str]:
    """Returns a list of these words. A single word becomes a list of one.

    Raises
    ------
    TypeError
        If it is no word and no list of words.
    ValueError
        If an entry is not one of these words.
    """
    value = unwrapped(name, value)
    words = list(words)
    if isinstance(value, Mapping) or not isinstance(value, Iterable) or isinstance(value, str | Enum):
        return [as_word(name, value, words)]
    return [as_word(f"{name}[{i}]", entry, words) for i, entry in enumerate(value)]


def unwrapped(name: str, value: object) -> object:
    """Returns the number or word in an array without axes. Returns other values unchanged.

    The array may be of another library, if NumPy can read it.
    """
    if value is np.ma.masked or (isinstance(value, np.ma.MaskedArray) and value.ndim == 0 and value.mask):
        raise ValueError(f"{name} is masked, and nothing can be sent for it")
    if isinstance(value, np.ndarray) or (hasattr(value, "__array__") and not isinstance(value, np.generic)):
        array = np.asarray(value)
        return array[()] if array.ndim == 0 else value
    return value


def nearest(word: object, words: Iterable[str]) -> str:
    """Returns a question that suggests the nearest word, or an empty string."""
    near = difflib.get_close_matches(str(word).lower(), list(words), n=1, cutoff=0.5)
    return f"; did you mean {near[0]!r}?" if near else ""


def _kind(value: object) -> str:
    """Describes a value that was given instead of the expected one."""
    if isinstance(value, np.ndarray):
        return f"an array of the shape {list(value.shape)}"
    if isinstance(value, str | bytes | bool | complex | np.generic):
        return f"{value!r}"
    return f"of the type {type(value).__name__}"
