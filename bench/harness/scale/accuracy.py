"""Errors of answers against the exact geometry."""

from dataclasses import dataclass

import numpy as np

from ..clouds import Floats

#: Half the width of a band that covers 95 % of a normal distribution, in standard deviations.
BAND = 1.96


@dataclass(frozen=True)
class Angles:
    """Errors of normals: quantiles of the angle, and the share of flipped normals.

    `median` and `high` (95 %) are in degrees between lines. `flipped` is in percent. A missing normal counts
    as 90° off.
    """

    median: float
    high: float
    flipped: float


def angles(found: Floats, exact: Floats, is_signed: bool) -> Angles:
    """Compares normals with the exact ones, wherever these are not zero.

    Some methods leave the overall sign open. Without `is_signed`, the sign of the majority is taken as right.
    """
    known = np.linalg.norm(exact, axis=1) > 0
    found, exact = found[known], exact[known]
    sines = np.linalg.norm(np.cross(found, exact), axis=1)
    cosines = np.einsum("ni,ni->n", found, exact)
    degrees = np.where(np.isnan(cosines), 90.0, np.degrees(np.arctan2(sines, np.abs(cosines))))
    flipped = float(np.mean(~(cosines >= 0)))
    if not is_signed:
        flipped = min(flipped, 1 - flipped)
    median, high = np.quantile(degrees, [0.5, 0.95])
    return Angles(float(median), float(high), 100 * flipped)


def outward(normals: Floats, curvatures: Floats, exact: Floats) -> Floats:
    """Returns curvatures for the side of the true normals, which peers do not know."""
    inside = np.einsum("ni,ni->n", normals, exact) < 0
    turned = curvatures.copy()
    turned[inside] = -curvatures[inside, ::-1]
    return turned


def mean_errors(found: Floats, exact: Floats) -> Floats:
    """Returns |H − H₀|/max |κ₀| at each point, infinite where there is no answer."""
    errors = np.abs(found.mean(axis=1) - exact.mean(axis=1)) / np.max(np.abs(exact), axis=1)
    return np.where(np.isnan(errors), np.inf, errors)


def principal_errors(found: Floats, exact: Floats) -> Floats:
    """Returns max |κ − κ₀|/max |κ₀| at each point, infinite where there is no answer."""
    errors = np.max(np.abs(found - exact), axis=1) / np.max(np.abs(exact), axis=1)
    return np.where(np.isnan(errors), np.inf, errors)


def coverage(found: Floats, deviations: Floats, exact: Floats) -> float:
    """Returns the percentage of bands ±1.96 σ that contain the truth. A missing band does not."""
    return 100 * float(np.mean(np.abs(found - exact) <= BAND * deviations))
