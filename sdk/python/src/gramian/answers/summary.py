"""Summaries of answers in a few lines, as `print` shows them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..plot.quantities import VECTORS, std_of
from ..rest.models import Diagnostics, KernelUsed
from ..rest.types import Unset
from ..wire.tensors import Array


def summary_of(answer: Any) -> str:  # noqa: ANN401 (an Answer)
    """Returns the numbers of positions and points, quantiles, flags by reason, solver, and warnings."""
    lines = [_title(answer), *_quantities(answer)]
    if hasattr(answer, "flags"):
        lines.append(f"flags: {counted(flag.reason.value for flag in answer.flags)}")
    if hasattr(answer, "diagnostics"):
        lines += [_solver(answer.diagnostics), *warnings_of(answer.diagnostics)]
    return "\n".join(lines)


def quantiles_of(numbers: Array, unit: str) -> str:
    """Returns percentiles 2, 50 and 98 of the known numbers, and how many are unknown."""
    known = numbers[np.isfinite(numbers)]
    n_unknown = numbers.size - known.size
    unknown = f", {n_unknown:,} NaN" if n_unknown else ""
    if known.size == 0:
        return f"no number{unknown}"
    low, median, high = (f"{number:.4g}" for number in np.percentile(known, [2, 50, 98]))
    return f"{low}, {median}, {high} {unit}".rstrip() + f" (2 %, median, 98 %){unknown}"


def counted(words: Iterator[str]) -> str:
    """Returns how often each word occurs, the most frequent first: `12 edge, 7 far_from_cloud`."""
    return ", ".join(f"{count:,} {word}" for word, count in Counter(words).most_common()) or "none"


def origin_of(said: Diagnostics) -> str:
    """Returns the number of points and their dimension: `from 500 points in 3 dimensions`."""
    return f"from {said.n_points:,} points in {said.dimension} dimension{'s' * (said.dimension > 1)}"


def _title(answer: Any) -> str:  # noqa: ANN401
    name = re.sub("(?<!^)(?=[A-Z])", " ", type(answer).__name__)
    if not hasattr(answer, "diagnostics"):
        return name
    said: Diagnostics = answer.diagnostics
    return f"{name} at {said.n_queries:,} positions, {origin_of(said)}"


def _quantities(answer: Any) -> Iterator[str]:  # noqa: ANN401
    for name in answer.SUMMARY:
        if not hasattr(answer, name):
            continue
        rows, what = answer.by_rows(name), name
        if name in VECTORS:
            rows, what = np.linalg.norm(rows, axis=-1), f"|{name}|"
        std = std_of(answer, name)
        deviation = "" if std is None or np.isnan(std).all() else f", median std {np.nanmedian(std):.3g}"
        yield f"{what}: {quantiles_of(rows.ravel(), answer.unit(name))}{deviation}"


def kernel_in_words(kernel: KernelUsed) -> str:
    """Returns the family and the parameters of a kernel, but not its variance."""
    scales = [kernel.length_scale] if isinstance(kernel.length_scales, Unset) else kernel.length_scales
    known = [f"{scale:.3g}" for scale in scales if not isinstance(scale, Unset)]
    nu = "" if isinstance(kernel.nu, Unset) else f" of nu {kernel.nu:g}"
    length = f", length scale{'s' * (len(known) > 1)} {', '.join(known)} L" if known else ""
    return f"{kernel.family.value}{nu}{length}"


def warnings_of(said: Diagnostics) -> list[str]:
    """Returns a line for each warning, or one that there is none."""
    return [f"warning: {warning.code.value}: {warning.detail}" for warning in said.warnings] or ["warnings: none"]


def _solver(said: Diagnostics) -> str:
    alpha = "" if isinstance(said.alpha, Unset) else f", alpha {said.alpha:.3g}"
    noise = "" if isinstance(said.noise_deviation, Unset) else f", noise of the points {said.noise_deviation:.3g} L"
    return f"solver: {said.solver.value}, kernel {kernel_in_words(said.kernel)}{alpha}{noise}"
