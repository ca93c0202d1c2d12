"""Conversion of callers' arguments to what is sent: a function, and a rule for every field of every method.

| a field | may be given as |
|---|---|
| nothing | None, absent, or the generated `UNSET` |
| a number | `int`, `float`, NumPy-like numbers and arrays without axes; fractions and decimals if exact |
| an array | lists, tuples, buffers, real NumPy arrays of any layout, objects with `__array__` (data frames) |
| a word | a string, or a member of an enumeration |
| words | a word, or several |
| a truth | `bool`, of Python or NumPy |
| a kernel | a family, a mapping, `Kernel`, or what `diagnostics.kernel` or `Client.kernels()` reports |
| a surface | `Surface`, a mapping, another `Cloud`, or what `diagnostics.surface` reports |
| hyperparameters | a mapping, or what `diagnostics.hyperparameters` reports |
| free parameters | a mapping to bounds, or a list of mappings with `parameter`, `min` and `max` |

Numbers are sent unchanged, as float64. Complex numbers, truth values, text, masked entries, NaN and infinity
are refused by name and place. So are integers that float64 cannot represent. The service refuses what is
mathematically wrong, such as a negative length scale.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeAlias

from ..rest.models import (
    Diagnostics,
    DuplicatePolicy,
    FreeParameter,
    GeometryAttribute,
    KernelDescription,
    KernelFamily,
    MeanChoice,
    MeshAttribute,
    MeshQuality,
    OrientationChoice,
    PosteriorQuantity,
    PosteriorTarget,
    SelectionCriterion,
    SelectionParameter,
    SolverChoice,
    SolverUsed,
    SurfaceModelChoice,
)
from ..rest.models import Surface as GeneratedSurface
from ..rest.types import Unset
from .arrays import Sizes, as_array
from .scalars import as_number, as_truth, as_whole, as_word, as_words, nearest, unwrapped

Rule: TypeAlias = Callable[[str, object, Sizes], object]
"""A function from a field's name, the given value and the known lengths to what is sent."""


def normalise(
    fields: Mapping[str, object], rules: Mapping[str, Rule], sizes: Sizes | None = None, path: str = ""
) -> dict[str, object]:
    """Returns the fields in the form that is sent, without absent ones.

    Parameters
    ----------
    fields
        The given values, by name.
    rules
        A rule for each existing field: `REQUEST`, `GEOMETRIC`, `MESH`, `BATCH`, `KERNEL`, `SURFACE`, `CLIENT`.
    sizes
        The known lengths of the axes of arrays, by name: n points, d coordinates.
    path
        Prefix of the names in messages: `kernel.`

    Raises
    ------
    TypeError
        If a field is unknown, missing, or of a wrong type.
    ValueError
        If a value cannot be sent.
    """
    for name in fields:
        if name not in rules:
            place, known = path.removesuffix(".") or "the request", ", ".join(map(repr, rules))
            raise TypeError(f"{place} has no {name!r}, but {known}{nearest(name, rules)}")
    _check_alpha(fields, path)
    given = {name: value for name, value in fields.items() if not _is_absent(value)}
    for name in fields:
        if name in REQUIRED and name not in given:
            raise TypeError(f"{path}{name} is missing")
    return {name: rules[name](path + name, value, sizes or {}) for name, value in given.items()}


def _is_absent(value: object) -> bool:
    return value is None or isinstance(value, Unset)


def _check_alpha(fields: Mapping[str, object], path: str) -> None:
    """Refuses the unset alpha of diagnostics. Left out, it would be replaced by the default alpha."""
    if isinstance(fields.get("alpha"), Unset) and _is_absent(fields.get("noise_variances")):
        raise ValueError(
            f"{path}alpha is absent from these diagnostics, of a fit with noise_variances: send those, or **answer.fit"
        )


def array(*axes: str) -> Rule:
    """Makes the rule for arrays with these axes."""
    return lambda name, value, sizes: as_array(name, value, axes, sizes)


def number(name: str, value: object, sizes: Sizes) -> float:  # noqa: ARG001
    """Applies the rule for numbers."""
    return as_number(name, value)


def whole(name: str, value: object, sizes: Sizes) -> int:  # noqa: ARG001
    """Applies the rule for whole numbers."""
    return as_whole(name, value)


def word(*words: str) -> Rule:
    """Makes the rule for one of these words."""
    known = list(dict.fromkeys(map(str, words)))
    return lambda name, value, _: as_word(name, value, known)


def words(*words: str) -> Rule:
    """Makes the rule for any of these words."""
    known = list(map(str, words))
    return lambda name, value, _: as_words(name, value, known)


def with_std(fields: Mapping[str, object]) -> dict[str, object]:
    """Returns the fields with `"std"` in `include` instead of the argument `std`."""
    others = {name: value for name, value in fields.items() if name != "std"}
    std, include = fields.get("std"), fields.get("include")
    if _is_absent(std) or not as_truth("std", std):
        return others
    wanted = [] if _is_absent(include) else as_words("include", include, MeshAttribute)
    return {**others, "include": list(dict.fromkeys([*wanted, MeshAttribute.STD.value]))}


def samples(name: str, value: object, sizes: Sizes) -> dict[str, object]:
    """Applies the rule for samples: their number, or a mapping with `count` and `seed`."""
    if not isinstance(value, Mapping):
        value = {"count": value}
    return normalise(value, {"count": whole, "seed": whole}, sizes, f"{name}.")


def kernel(name: str, value: object, sizes: Sizes) -> dict[str, object]:
    """Applies the rule for kernels."""
    value = unwrapped(name, value)
    if isinstance(value, str | KernelDescription):
        value = {"family": value if isinstance(value, str) else value.family}
    later: Mapping[str, object] = {}
    if not isinstance(value, Mapping):
        if not hasattr(value, "family"):
            kind = type(value).__name__
            raise TypeError(f"{name} is to be a family such as 'gauss', a mapping, or a Kernel, not of the type {kind}")
        later = getattr(value, "additional_properties", {})  # of a service newer than this client
        value = {parameter: getattr(value, parameter, None) for parameter in KERNEL}
    return {**normalise({"family": None, **value}, KERNEL, sizes, f"{name}."), **later}


def bounds(name: str, value: object, sizes: Sizes) -> dict[str, float]:  # noqa: ARG001
    """Applies the rule for bounds: the least and the greatest value."""
    least, greatest = as_array(name, value, ["bounds"], {"bounds": 2}).tolist()
    return {"min": least, "max": greatest}


def box(name: str, value: object, sizes: Sizes) -> dict[str, object]:
    """Applies the rule for boxes: the least and the greatest coordinates, a row each."""
    least, greatest = as_array(name, value, ["corners", "d"], {**sizes, "corners": 2})
    return {"min": least, "max": greatest}


def truth(name: str, value: object, sizes: Sizes) -> bool:  # noqa: ARG001
    """Applies the rule for true or false."""
    return as_truth(name, value)


def vary(name: str, value: object, sizes: Sizes) -> list[dict[str, object]]:
    """Applies the rule for free parameters: bounds by name, or a list of parameters."""
    if isinstance(value, Mapping):
        free: Mapping[str, Any] = normalise(value, BOUNDS, sizes, f"{name}.")
        return [{"parameter": str(parameter), **limits} for parameter, limits in free.items()]
    if not isinstance(value, Iterable) or isinstance(value, str):
        kind = type(value).__name__
        raise TypeError(f"{name} is to be a mapping such as {{'alpha': (1e-6, 1)}}, or a list, not of the type {kind}")
    return [free_parameter(f"{name}[{i}]", entry, sizes) for i, entry in enumerate(value)]


def free_parameter(name: str, value: object, sizes: Sizes) -> dict[str, object]:
    """Applies the rule for an entry of a list of free parameters."""
    if isinstance(value, FreeParameter):
        value = {"parameter": value.parameter, "axis": value.axis, "min": value.min_, "max": value.max_}
    if not isinstance(value, Mapping):
        kind, example = type(value).__name__, {"parameter": "alpha", "min": 1e-6, "max": 1}
        raise TypeError(f"{name} is to be a mapping such as {example}, not of the type {kind}")
    return normalise({"parameter": None, "min": None, "max": None, **value}, FREE_PARAMETER, sizes, f"{name}.")


def surface(name: str, value: object, sizes: Sizes) -> dict[str, object]:
    """Applies the rule for the surface of an operator."""
    if isinstance(value, Diagnostics):
        is_local = value.solver is SolverUsed.LOCAL  # takes neither, but chooses them by its likelihood
        fit = {} if is_local else {"kernel": value.kernel, "alpha": value.alpha}
        value = {"cloud": value, **fit, "solver": value.solver}
    elif isinstance(value, GeneratedSurface):
        # UNSET here means that the caller gave nothing, not that diagnostics have none.
        value = {field: None if _is_absent(said := getattr(value, field)) else said for field in SURFACE}
    elif hasattr(value, "model"):
        value = {field: getattr(value, field) for field in SURFACE}
    elif not isinstance(value, Mapping):
        value = {"cloud": value}
    if not _is_absent(value.get("cloud")):
        n, d = getattr(value["cloud"], "n_points", None), sizes.get("d")
        sizes = {axis: length for axis, length in {"n": n, "d": d}.items() if length is not None}
    return normalise(value, SURFACE, sizes, f"{name}.")


def cloud(name: str, value: object, sizes: Sizes) -> dict[str, object]:  # noqa: ARG001
    """Applies the rule for another cloud, which is sent by its id."""
    found = value.get("id") if isinstance(value, Mapping) else value
    for attribute in ["id", "cloud_id"]:  # of a Cloud; of diagnostics
        found = getattr(found, attribute, found)
    if not isinstance(found, str):
        kind = type(value).__name__
        raise TypeError(f"{name} is to be a Cloud, as Client.cloud(points) returns, not of the type {kind}")
    if not re.fullmatch("[0-9a-f]{64}", found):
        raise ValueError(f"{name} is {found!r}, and ids of clouds are 64 hexadecimal digits")
    return {"id": str(found)}


def hyperparameters(name: str, value: object, sizes: Sizes) -> dict[str, object]:  # noqa: ARG001
    """Applies the rule for hyperparameters: a mapping, or what diagnostics report."""
    found = value.to_dict() if hasattr(value, "to_dict") else value
    if not isinstance(found, Mapping):
        kind = type(value).__name__
        raise TypeError(f"{name} is to be the diagnostics.hyperparameters of an answer, not of the type {kind}")
    return dict(found)


def duration(name: str, value: object, sizes: Sizes) -> float:
    """Applies the rule for seconds, which may be infinite."""
    seconds = math.inf if isinstance(value, float) and value == math.inf else number(name, value, sizes)
    if seconds < 0:
        raise ValueError(f"{name} is {seconds}, and times are not negative")
    return seconds


REQUIRED = frozenset({"points", "values", "family", "parameter", "min", "max"})
"""The fields that cannot be absent."""

KERNEL: Mapping[str, Rule] = {
    "family": word(*KernelFamily),
    "length_scale": number,
    "length_scales": array("d"),
    "variance": number,
    "epsilon": number,
    "nu": number,
    "smoothness": whole,
}

FIT: Mapping[str, Rule] = {
    "kernel": kernel,
    "alpha": number,
    "noise_variances": array("n"),
    # The solver that an answer reports can be sent too. The service refuses it if it is no valid choice.
    "solver": word(*SolverChoice, *SolverUsed),
}

SURFACE: Mapping[str, Rule] = {**FIT, "cloud": cloud, "model": word(*SurfaceModelChoice)}

BOUNDS: Mapping[str, Rule] = {parameter.value: bounds for parameter in SelectionParameter}

FREE_PARAMETER: Mapping[str, Rule] = {
    "parameter": word(*SelectionParameter),
    "axis": whole,
    "min": number,
    "max": number,
}

REQUEST: Mapping[str, Rule] = {
    **FIT,
    "tolerance": number,
    "duplicates": word(*DuplicatePolicy),
    "points": array("n", "d"),
    "normals": array("n", "d"),
    "values": array("n"),
    "queries": array("m", "d"),
    "sites": array("s", "d"),
    "hyperparameters": hyperparameters,
    "derivatives": whole,
    "mean": word(*MeanChoice),
    "include": words(*PosteriorQuantity),
    "samples": samples,
    "quantiles": array("quantiles"),
    "threshold": number,
    "of": word(*PosteriorTarget),
    "surface_model": word(*SurfaceModelChoice),
    "orientation": word(*OrientationChoice),
    "surface": surface,
    "criterion": word(*SelectionCriterion),
    "vary": vary,
    "families": words(*KernelFamily),
    "restarts": whole,
    "seed": whole,
}

GEOMETRIC: Mapping[str, Rule] = {**REQUEST, "include": words(*GeometryAttribute)}
"""Rules for normals and curvatures, and for values and operators that may have deviations."""

MESH: Mapping[str, Rule] = {
    **REQUEST,
    "include": words(*MeshAttribute),
    "level": number,
    "step": number,
    "bounds": box,
    "quality": word(*MeshQuality),
    "open": truth,
}
"""Rules for meshes."""

BATCH: Mapping[str, Rule] = {**REQUEST, "values": array("k", "n")}
"""Rules for many lists of values."""

GEOMETRIC_BATCH: Mapping[str, Rule] = {**GEOMETRIC, "values": array("k", "n")}
"""Rules for many lists of values that may have deviations."""

CLIENT: Mapping[str, Rule] = {
    "timeout": duration,
    "retries": whole,
    "max_wait": duration,
    "format": word("safetensors", "json"),
    "page_size": whole,
}
