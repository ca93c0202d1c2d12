"""Colours of numbers in files, by scales of matplotlib at their anchors, and grey where a number is uncertain."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..plot.colours import faded, limits_of
from ..plot.quantities import is_signed
from ..wire.tensors import Array

SCALES = {
    "RdYlBu_r": "313695 4575b4 74add1 abd9e9 e0f3f8 ffffbf fee090 fdae61 f46d43 d73027 a50026",
    "viridis": "440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725",
}
"""Eleven anchors of scales of matplotlib, evenly spaced, sRGB. They are those of its pictures by default."""


def colours_of(values: Array, std: Array | None, quantity: str) -> npt.NDArray[np.uint8]:
    """Returns colours `[m, 3]`, as `answer.plot()` has them. NaN is grey."""
    signed = is_signed(quantity)
    low, high = limits_of(values, is_signed=signed)
    share = np.clip((values - low) / (high - low), 0, 1)
    anchors = np.array([list(bytes.fromhex(colour)) for colour in SCALES["RdYlBu_r" if signed else "viridis"].split()])
    at = np.linspace(0, 1, len(anchors))
    colours = np.column_stack([np.interp(share, at, channel) for channel in anchors.T / 255])
    uncertain = np.where(np.isfinite(values), 0.0 if std is None else std, np.inf)
    shown = faded(np.nan_to_num(colours), uncertain, (low, high))
    return np.rint(255 * shown).astype(np.uint8)
