"""Tables: points by the names of their columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from ..wire.tensors import Array
from .scalars import nearest


class Table(Protocol):
    """A DataFrame, a Dataset, a structured array, or a dictionary of columns."""

    def __getitem__(self, name: Any, /) -> Any: ...  # noqa: ANN401


def columns_of(table: object, columns: Sequence[str]) -> Array:
    """Returns columns of a table side by side, `[n, d]`.

    Raises
    ------
    TypeError
        If it is no table, or `columns` is a single name.
    ValueError
        If the table lacks a column, or columns differ in length.
    """
    if isinstance(columns, str):
        raise TypeError(f"columns is to be a list of names, such as [{columns!r}], not a single one")
    if isinstance(table, str | bytes) or not hasattr(table, "__getitem__"):
        raise TypeError(f"columns are those of a table, and points are of the type {type(table).__name__}")
    found = [_column(table, name) for name in columns]
    lengths = {name: len(column) for name, column in zip(columns, found, strict=True)}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"columns are to be of one length, not {lengths}")
    return np.column_stack(found)


def _column(table: Any, name: str) -> Array:  # noqa: ANN401
    try:
        column = table[name]
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ValueError(f"points have no column {name!r}{nearest(name, _names(table))}") from error
    return np.ravel(np.asarray(column, dtype=np.float64))


def _names(table: Any) -> Iterable[str]:  # noqa: ANN401
    """Returns the names of the columns, as far as the table has them."""
    fields = getattr(getattr(table, "dtype", None), "names", None)
    return [str(name) for name in fields or (table if hasattr(table, "keys") else [])]
