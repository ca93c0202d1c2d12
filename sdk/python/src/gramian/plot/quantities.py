"""The quantity of an answer that pictures show, as one number for each row."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..wire.tensors import Array

QUANTITIES = (
    "mean_curvatures",
    "values",
    "means",
    "laplacians",
    "gradients",
    "residuals",
    "gradient_norms",
)
"""What is shown if nothing is named, the first that there is."""

SIGNED = ("curvatures", "laplacians")
"""Endings of quantities whose colours are symmetric about 0."""

VECTORS = ("gradients",)
"""Quantities that are shown by their lengths."""


def default_quantity(answer: object) -> str | None:
    """Returns the quantity that is shown if none is named."""
    return next((name for name in QUANTITIES if isinstance(getattr(answer, name, None), np.ndarray)), None)


def is_signed(quantity: str) -> bool:
    """Returns whether colours are symmetric about 0."""
    return quantity.endswith(SIGNED)


def scalars_of(answer: Any, quantity: str) -> Array:  # noqa: ANN401 (an Answer)
    """Returns a number for each row `[m]`: lengths of vectors, and the first of several components.

    Raises
    ------
    AttributeError, ValueError
        If the quantity was not asked for, or if such answers have none.
    """
    return _one(answer.by_rows(quantity), quantity)


def std_of(answer: Any, quantity: str) -> Array | None:  # noqa: ANN401 (an Answer)
    """Returns the standard deviations of a quantity `[m]`, if the answer has them."""
    if quantity == "means" and hasattr(answer, "variances"):
        std: Array = np.sqrt(answer.by_rows("variances"))
        return std
    name = f"{quantity.removesuffix('s')}_std"
    return _one(answer.by_rows(name), quantity) if hasattr(answer, name) else None


def _one(rows: Array, quantity: str) -> Array:
    """Returns one number for each row."""
    if quantity in VECTORS:
        lengths: Array = np.linalg.norm(rows.reshape(len(rows), -1, rows.shape[-1])[:, 0], axis=1)
        return lengths
    return rows.reshape(len(rows), -1)[:, 0]
