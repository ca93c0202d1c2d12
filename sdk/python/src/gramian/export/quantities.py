"""Shapes and units of the members of answers, as their docstrings declare them."""

from __future__ import annotations

import functools
import inspect
import re
from dataclasses import dataclass

ENTRY = re.compile(r"^(\w+)\n    `\[([^\]]+)\]`(?:, ([^.,]+))?", re.MULTILINE)
"""An entry of a docstring: a name, and below it the axes and the unit."""

UNIT = re.compile(r"(?:[1V]²?/)?L(?:²|\^\(d − 1\))?|V²?|radians")

POWERS = {1: "", 2: "²", 3: "³"}


@dataclass(frozen=True)
class Quantity:
    """The names of the axes of an array, and its unit: L for lengths, V for values, empty if it has none."""

    axes: tuple[str, ...]
    unit: str


def quantities_of(kind: type) -> dict[str, Quantity]:
    """Returns the arrays that a class of answers documents, by name. Empty under `python -OO`.

    >>> from gramian.export import quantities_of
    >>> quantities_of(gramian.Curvatures)["principal_curvatures"]
    Quantity(axes=('m', 'd − 1'), unit='1/L')
    """
    return _documented(tuple(base.__doc__ or "" for base in reversed(kind.__mro__)))


@functools.cache
def _documented(docs: tuple[str, ...]) -> dict[str, Quantity]:
    entries = [entry for doc in docs for entry in ENTRY.findall(inspect.cleandoc(doc))]
    return {
        name: Quantity(tuple(axes.split(", ")), unit if UNIT.fullmatch(unit) else "") for name, axes, unit in entries
    }


def in_units(unit: str, dimension: int, length: str = "L", value: str = "V") -> str:
    """Returns a unit for a dimension, with the units of lengths and of values.

    >>> from gramian.export import in_units
    >>> in_units("1/L^(d − 1)", 3, "mm"), in_units("V²/L²", 3, "mm", "m/s"), in_units("radians", 3, "mm")
    ('1/mm²', '(m/s)²/mm²', 'radians')
    """
    if unit == "radians":
        return unit
    power = dimension - 1
    plain = unit.replace("^(d − 1)", POWERS.get(power, f"^{power}"))
    return re.sub("[LV]", lambda found: _factor(length if found[0] == "L" else value, plain), plain)


def _factor(unit: str, whole: str) -> str:
    """Returns a unit as a factor of another one: in parentheses if it is not a single word."""
    return unit if len(whole) == 1 or re.fullmatch(r"[\w°%µ]+", unit) else f"({unit})"
