"""Axes of pictures: their names with units, and the directions of space with a length."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..wire.tensors import Array
from .needed import needed

AXES = ("x", "y", "z")


def axes_of(ax: Any) -> Any:  # noqa: ANN401 (Axes)
    """Returns the axes that are given, or else new ones."""
    return needed("matplotlib.pyplot", "plot").subplots(layout="constrained")[1] if ax is None else ax


def labelled(name: str, unit: str) -> str:
    """Returns the name of an axis with its unit.

    >>> from gramian.plot.axes import labelled
    >>> labelled("mean curvatures", "1/mm"), labelled("levels", "")
    ('mean curvatures, 1/mm', 'levels')
    """
    return f"{name}, {unit}" if unit else name


def name_plane(axes: Any, length: str) -> None:  # noqa: ANN401 (Axes)
    """Names the axes of a picture of the plane."""
    axes.set_xlabel(labelled("x", length))
    axes.set_ylabel(labelled("y", length))


def draw_directions(axes: Any, view: Array, box: tuple[float, float, float, float], length: str) -> None:  # noqa: ANN401 (Axes)
    """Draws the directions of space below a picture, each as long as the caption says.

    `view` has the axes of the picture as rows, `box` its left, right, bottom and top.
    """
    left, right, bottom, top = box
    size = round_length(max(right - left, top - bottom) / 6)
    ends = size * view[:2].T  # of x, y, z in the picture
    corner = np.array([left, bottom]) - ends.clip(max=0).min(axis=0) - [0, 1.6 * size]
    for name, end in zip(AXES, ends, strict=True):
        axes.plot(*np.transpose([corner, corner + end]), color="0.3", linewidth=1)
        axes.annotate(name, corner + 1.2 * end, color="0.3", ha="center", va="center", fontsize="small")
    axes.annotate(f"{size:g} {length}", (corner[0] + 1.4 * size, corner[1]), color="0.3", va="center", fontsize="small")


def round_length(length: float) -> float:
    """Returns the greatest of 1, 2 and 5 times a power of ten that is not longer.

    >>> from gramian.plot.axes import round_length
    >>> round_length(0.37), round_length(7), round_length(0)
    (0.2, 5.0, 1.0)
    """
    if not length > 0 or not np.isfinite(length):
        return 1.0
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(step * power for step in (1, 2, 5) if step * power <= length))
