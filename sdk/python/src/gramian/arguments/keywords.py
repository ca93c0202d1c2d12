"""Keywords of methods: errors for misspelt ones, and descriptions of those that several methods share.

Errors name the nearest parameter, as Python's own do from version 3.13 on.
"""

from __future__ import annotations

import functools
import inspect
import re
import sys
from collections.abc import Callable
from inspect import Parameter, Signature
from typing import ParamSpec, TypeVar, get_args, get_type_hints, is_typeddict

from .normalise import KERNEL
from .scalars import nearest

C = TypeVar("C", bound=type)
P = ParamSpec("P")
T = TypeVar("T")


def suggest_names(cls: C) -> C:
    """Makes the constructor and public methods of a class suggest the parameter that was probably meant.

    If a method takes the keys of a `TypedDict`, `**options: Unpack[…]`, they appear in its signature and its
    docstring, so that `help` shows them.
    """
    for name, member in list(vars(cls).items()):
        if inspect.isfunction(member) and (name == "__init__" or not name.startswith("_")):
            setattr(cls, name, _suggesting(member))
    return cls


def _suggesting(function: Callable[P, T]) -> Callable[P, T]:
    signature, doc = _with_options(function)
    names = [name for name in signature.parameters if name != "self"]
    called = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> T:
        for name in kwargs:
            if name not in names:
                advice = "; it is one of a Kernel" if name in KERNEL and "kernel" in names else nearest(name, names)
                raise TypeError(f"{called}() has no parameter {name!r}{advice}")
        return function(*args, **kwargs)

    checked.__signature__ = signature  # type: ignore[attr-defined]  # which inspect reads
    checked.__doc__ = doc
    return checked


def _with_options(function: Callable[..., object]) -> tuple[Signature, str | None]:
    """Returns the signature and the docstring of a function, with the keys of its `**options`."""
    signature = inspect.signature(function)
    *parameters, last = signature.parameters.values()
    if last.kind is not Parameter.VAR_KEYWORD:
        return signature, function.__doc__
    [options] = get_args(get_type_hints(function)[last.name])
    for name, annotation in _annotations(options).items():
        parameters.append(Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=annotation))
    head, returns, tail = inspect.cleandoc(function.__doc__ or "").partition("\n\nReturns\n-------\n")
    return signature.replace(parameters=parameters), "\n".join([head, *_descriptions(options)]) + returns + tail


def _descriptions(options: type) -> list[str]:
    """Returns the entries about the keys of a `TypedDict`, from its docstring and those of its bases.

    A `TypedDict` does not know its bases, but these are in the module where it is defined.
    """
    found: dict[str, str] = {}
    wanted = _annotations(options)
    for base in filter(is_typeddict, vars(sys.modules[options.__module__]).values()):
        _, _, keys = inspect.cleandoc(base.__doc__ or "").partition("Keys\n----\n")
        for entry in re.findall(r"^\w.*(?:\n    .*)*", keys, re.MULTILINE):
            name = entry.partition(" : ")[0]
            if _annotations(base)[name] == wanted.get(name):
                found[name] = entry
    return [found[name] for name in wanted if name in found]


def _annotations(kind: type) -> dict[str, object]:
    """Returns the annotations of a `TypedDict` as they are written."""
    return {name: getattr(hint, "__forward_arg__", hint) for name, hint in kind.__annotations__.items()}
