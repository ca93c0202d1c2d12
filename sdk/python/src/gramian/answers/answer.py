"""The base class of all answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from ..arguments.describe import described
from ..rest.models import Diagnostics, FamilyScore, Flag, KernelUsed, MeshPart, SurfaceModelUsed
from ..wire.tensors import Array, Members
from .html import page_of

OBJECTS: Mapping[str, Callable[[Any], object]] = {
    "diagnostics": Diagnostics.from_dict,
    "kernel": KernelUsed.from_dict,
    "flags": lambda entries: tuple(map(Flag.from_dict, entries)),
    "parts": lambda parts: tuple(map(MeshPart.from_dict, parts)),
    "dropped_parts": lambda parts: tuple(map(MeshPart.from_dict, parts)),
    "families": lambda entries: tuple(map(FamilyScore.from_dict, entries)),
    "surface_models": lambda names: tuple(map(SurfaceModelUsed, names)),
}
"""Readers of the members that are neither arrays nor single numbers, by name."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer:
    """The base class of all answers. `repr` shows arrays by their shapes, and leaves out absent members.

    Attributes
    ----------
    positions
        `[m, d]`, L. The queries, or without them the points. None if the client has no copy of the points.
    """

    positions: Array | None = None

    def __repr__(self) -> str:
        return described(type(self).__name__, self._shown())

    def _repr_html_(self) -> str:
        return page_of(type(self).__name__, self._shown())

    def _shown(self) -> dict[str, object]:
        # `fit` is left out, because it repeats the diagnostics and the request, and so do positions.
        return {name: value for name, value in vars(self).items() if name not in ("fit", "positions")}

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer, whose members have the names of the fields.

        `derived` has the fields that are not read so.

        Raises
        ------
        TypeError
            If the answer lacks a member without default.
        """
        names = [field.name for field in fields(cls) if field.name in members and field.name not in derived]
        found: dict[str, Any] = {name: _member(members, name) for name in names}
        return cls(**found | derived)


def _member(members: Members, name: str) -> object:
    if name in OBJECTS:
        return OBJECTS[name](members[name])
    return members.array(name) if isinstance(members[name], np.ndarray | list) else members[name]


def numbers_of(answer: Answer, n_rows: int) -> dict[str, Array]:
    """Returns the arrays of an answer that have a row for each of its positions or vertices, by name."""
    rows = {
        name: value for name, value in vars(answer).items() if isinstance(value, np.ndarray) and name != "positions"
    }
    return {name: array for name, array in rows.items() if array.dtype == np.float64 and len(array) == n_rows}
