"""Errors for misspelt keywords that name the nearest parameter, as Python's own do from version 3.13 on."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from .normalise import KERNEL
from .scalars import nearest

C = TypeVar("C", bound=type)
P = ParamSpec("P")
T = TypeVar("T")


def suggest_names(cls: C) -> C:
    """Makes the constructor and public methods of a class suggest the parameter that was probably meant."""
    for name, member in list(vars(cls).items()):
        if inspect.isfunction(member) and (name == "__init__" or not name.startswith("_")):
            setattr(cls, name, _suggesting(member))
    return cls


def _suggesting(function: Callable[P, T]) -> Callable[P, T]:
    names = [name for name in inspect.signature(function).parameters if name != "self"]
    called = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> T:
        for name in kwargs:
            if name not in names:
                advice = "; it is one of a Kernel" if name in KERNEL and "kernel" in names else nearest(name, names)
                raise TypeError(f"{called}() has no parameter {name!r}{advice}")
        return function(*args, **kwargs)

    return checked
