"""Answers as notebooks show them: a table of their members, and a histogram of the first numbers."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import numpy as np

from ..arguments.describe import in_words
from ..rest.types import Unset
from ..wire.tensors import Array

BINS = 40
WIDTH, HEIGHT = 240, 60


def page_of(kind: str, members: Mapping[str, object]) -> str:
    """Returns the members of an answer as HTML."""
    present = {name: value for name, value in members.items() if not (value is None or isinstance(value, Unset))}
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(in_words(value))}</td><td>{escape(_range(value))}</td></tr>"
        for name, value in present.items()
        if name not in ("diagnostics", "fit")
    )
    numbers = next((array for array in present.values() if _is_numbers(array)), None)
    figure = "" if numbers is None else histogram(numbers)
    return f"<b>{escape(kind)}</b><table><tr><th></th><th></th><th>2 %, median, 98 %</th></tr>{rows}</table>{figure}"


def histogram(numbers: object) -> str:
    """Returns the distribution of numbers between percentiles 2 and 98 as SVG."""
    known = _known(numbers)
    if known.size == 0:
        return ""
    low, high = np.percentile(known, [2, 98])
    counts, _ = np.histogram(known, BINS, (low, high) if low < high else (low - 0.5, high + 0.5))
    step, most = WIDTH / BINS, max(int(counts.max()), 1)
    bars = "".join(
        f'<rect x="{at * step:.1f}" y="{HEIGHT - tall:.1f}" width="{step - 0.5:.1f}" height="{tall:.1f}"/>'
        for at, tall in enumerate(HEIGHT * counts / most)
    )
    return f'<svg role="img" aria-label="histogram" width="{WIDTH}" height="{HEIGHT}" fill="#3f7fc4">{bars}</svg>'


def _is_numbers(value: object) -> bool:
    return isinstance(value, np.ndarray) and value.dtype == np.float64 and value.size > 0


def _known(value: object) -> Array:
    array = np.asarray(value, dtype=np.float64)
    return array[np.isfinite(array)]


def _range(value: object) -> str:
    if not _is_numbers(value) or (known := _known(value)).size == 0:
        return ""
    return ", ".join(f"{number:.4g}" for number in np.percentile(known, [2, 50, 98]))
