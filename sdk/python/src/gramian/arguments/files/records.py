"""Rows of binary numbers, and rows of numbers in text."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from .columns import Columns

NUMBER = re.compile(r"[+-]?((\d+(\.\d*)?|\.\d+)(e[+-]?\d+)?|nan|inf(inity)?)", re.IGNORECASE | re.ASCII)
"""Decimal numbers and, as scanners write what they have not measured, NaN and infinities."""


def columns_of(content: bytes, count: int, dtype: npt.DTypeLike, record: str) -> Columns:
    """Reads records of equal size, one after another.

    Raises
    ------
    ValueError
        If the bytes are too few, before anything is allocated.
    """
    kind = np.dtype(dtype)
    n_there = len(content) // kind.itemsize
    if n_there < count:
        raise ends_early(record, n_there, count)
    rows = np.frombuffer(content, kind, count)
    with np.errstate(invalid="ignore"):  # signalling NaN
        numbers = {name: rows[name].astype(np.float64) for name in kind.names or ()}
    return Columns(numbers, record=record)


def ends_early(record: str, n_there: int, announced: int) -> ValueError:
    """Makes the refusal of a file that has `n_there` whole records of those announced."""
    return ValueError(f"the file ends before the end of {record} {n_there + 1} of {announced}")


def lines_of(content: bytes, n_before: int = 0) -> Iterator[tuple[int, list[str]]]:
    """Yields the words of lines that are not blank, with the number of the line."""
    for number, line in enumerate(content.split(b"\n"), n_before + 1):
        words = line.decode("latin-1").split()
        if words:
            yield number, words


def number_of(word: str, line: int) -> float:
    """Returns the number that a word is.

    Raises
    ------
    ValueError
        If it is none.
    """
    if not NUMBER.fullmatch(word):
        raise ValueError(f'line {line}: "{_as_text(word)}" is no number')
    return float(word)


def text_columns(names: Sequence[str], rows: Sequence[Sequence[float]], lines: Sequence[int]) -> Columns:
    """Makes columns of rows."""
    table = np.array(rows, dtype=np.float64).reshape(-1, len(names))
    return Columns({name: table[:, at] for at, name in enumerate(names)}, lines)


def _as_text(word: str) -> str:
    """Returns the beginning of a word of bytes as the text that it is."""
    return word.encode("latin-1").decode("utf-8", "replace")[:40]
