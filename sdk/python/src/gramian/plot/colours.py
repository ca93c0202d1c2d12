"""Colours of values, which fade to grey as their deviations grow (Correll, Moritz and Heer 2018)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..wire.tensors import Array
from .needed import needed

GREY = 0.62
STEPS = 4


def limits_of(values: Array, *, is_signed: bool) -> tuple[float, float]:
    """Returns percentiles 2 and 98 of the known values, symmetric about 0 for signed quantities."""
    known = values[np.isfinite(values)]
    if known.size == 0:
        return 0.0, 1.0
    low, high = np.percentile(known, [2, 98])
    if is_signed:
        high = max(-low, high)
        low = -high
    return (float(low), float(high)) if low < high else (float(low) - 0.5, float(high) + 0.5)


def mappable_of(limits: tuple[float, float], cmap: str) -> Any:  # noqa: ANN401 (a ScalarMappable)
    """Returns the scale of colours between two values."""
    colors, cm = needed("matplotlib.colors", "plot"), needed("matplotlib.cm", "plot")
    return cm.ScalarMappable(colors.Normalize(*limits), cmap)


def colours_of(mappable: Any, values: Array, std: Array | None) -> Array:  # noqa: ANN401
    """Returns colours `[m, 3]`. They are grey where the deviation is half the range of colours, in four steps."""
    rgb: Array = mappable.to_rgba(values)[:, :3]
    return rgb if std is None else faded(rgb, std, (mappable.norm.vmin, mappable.norm.vmax))


def faded(rgb: Array, std: Array, limits: tuple[float, float]) -> Array:
    """Returns colours `[m, 3]` that are grey where the deviation is half the range of colours, in four steps."""
    share = np.nan_to_num(std / (0.5 * (limits[1] - limits[0])), nan=1.0)
    step = np.minimum(np.floor(np.clip(share, 0, 1) * STEPS), STEPS - 1) / (STEPS - 1)
    greyed: Array = rgb + (0.92 * step)[:, None] * (GREY - rgb)
    return greyed
