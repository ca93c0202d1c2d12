"""How far answers are from the truth."""

from dataclasses import dataclass

import numpy as np

from ..clouds import Floats

#: Half the width of a band that covers 95 % of a normal distribution, in standard deviations.
BAND = 1.96


@dataclass(frozen=True)
class Angles:
    """Degrees between lines, and the share of normals on the wrong side, in percent; a missing normal is 90° off."""

    median: float
    high: float
    flipped: float


def angles(found: Floats, exact: Floats, is_signed: bool) -> Angles:
    """Where the truth is zero there is none. Without a sign that of the majority counts: some methods leave it open."""
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
    """Curvatures for the side of the true normals, which peers do not know."""
    inside = np.einsum("ni,ni->n", normals, exact) < 0
    turned = curvatures.copy()
    turned[inside] = -curvatures[inside, ::-1]
    return turned


def mean_errors(found: Floats, exact: Floats) -> Floats:
    """|H − H₀|/max |κ₀| at each point, infinite where there is no answer."""
    errors = np.abs(found.mean(axis=1) - exact.mean(axis=1)) / np.max(np.abs(exact), axis=1)
    return np.where(np.isnan(errors), np.inf, errors)


def principal_errors(found: Floats, exact: Floats) -> Floats:
    """max |κ − κ₀|/max |κ₀| at each point, infinite where there is no answer."""
    errors = np.max(np.abs(found - exact), axis=1) / np.max(np.abs(exact), axis=1)
    return np.where(np.isnan(errors), np.inf, errors)


def coverage(found: Floats, deviations: Floats, exact: Floats) -> float:
    """The percentage of bands of ±1.96 σ that hold the truth; a missing band does not."""
    return 100 * float(np.mean(np.abs(found - exact) <= BAND * deviations))
