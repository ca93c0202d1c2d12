"""The base class of all answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from ..arguments.describe import described
from ..rest.models import Degenerate, Diagnostics, FamilyScore, KernelUsed, SurfaceUsed
from ..wire.tensors import Members

OBJECTS: Mapping[str, Callable[[Any], object]] = {
    "diagnostics": Diagnostics.from_dict,
    "kernel": KernelUsed.from_dict,
    "degenerate": lambda entries: tuple(map(Degenerate.from_dict, entries)),
    "families": lambda entries: tuple(map(FamilyScore.from_dict, entries)),
    "surfaces": lambda names: tuple(map(SurfaceUsed, names)),
}
"""Readers of the members that are neither arrays nor single numbers, by name."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer:
    """The base class of all answers. `repr` shows arrays by their shapes, and leaves out absent members."""

    def __repr__(self) -> str:
        # `fit` is left out, because it repeats the diagnostics and the request.
        members = {name: value for name, value in vars(self).items() if name != "fit"}
        return described(type(self).__name__, members)

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
