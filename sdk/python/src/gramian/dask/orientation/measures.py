"""What regions of a surface measure: sums over their points, so that those of a piece follow from all tiles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from ...wire.tensors import Array
from ..cells.cut import Ints

Truths = npt.NDArray[np.bool_]

SPACING_NEIGHBOURS = 4


@dataclass(frozen=True)
class Measures:
    """Of each region by the own points x of a tile, with normals ν and areas a; 0 for a region without any.

    Attributes
    ----------
    n_points, n_signed, n_coarse
        `[r]`. How many there are, how many where the coarse function says much of the side, and how many of the coarse
        cloud.
    areas
        `[r]`, L^(d − 1). Σa.
    centres
        `[r, d]`, L. Σax/Σa.
    spreads
        `[r]`, L^(d + 1). Σa|x − c|² about the centre c.
    normals
        `[r, d]`, L^(d − 1). Σaν.
    volumes
        `[r]`, L^d. Σa(x − c)·ν, d times the volume between the region and its centre.
    lower, upper
        `[r, d]`, L. The sides of its bounding box.
    """

    n_points: Array
    n_signed: Array
    n_coarse: Array
    areas: Array
    centres: Array
    spreads: Array
    normals: Array
    volumes: Array
    lower: Array
    upper: Array

    def __len__(self) -> int:
        return len(self.areas)

    @classmethod
    def of(
        cls,
        regions: tuple[Ints, int],
        points: Array,
        normals: Array,
        areas: Array,
        has_sign: Truths,
        is_coarse: Truths,
    ) -> Measures:
        """Adds up what is said of points `[m]`, in these regions of so many."""
        labels, count = regions
        weights, totals = areas[:, None], sums(labels, areas, count)
        # Points that all coincide have no area, and are where they are.
        centres = means(labels, points, np.where(totals[labels] > 0, areas, 1), count)
        arms = points - centres[labels]
        lower, upper = np.full((2, count, points.shape[1]), np.inf)
        np.minimum.at(lower, labels, points)
        np.minimum.at(upper, labels, -points)
        return cls(
            n_points=sums(labels, np.ones(len(labels)), count),
            n_signed=sums(labels, has_sign, count),
            n_coarse=sums(labels, is_coarse, count),
            areas=totals,
            centres=centres,
            spreads=sums(labels, areas * (arms**2).sum(axis=1), count),
            normals=columns(labels, weights * normals, count),
            volumes=sums(labels, areas * (arms * normals).sum(axis=1), count),
            lower=lower,
            upper=-upper,
        )

    @classmethod
    def joined(cls, parts: Sequence[Measures]) -> Measures:
        """Returns those of all tiles, one after the other."""
        return cls(*[np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(cls)])


def sums(labels: Ints, weights: npt.NDArray[np.generic], count: int) -> Array:
    """Adds up weights by label, `[count]`."""
    return np.bincount(labels, weights, count).astype(np.float64)


def columns(labels: Ints, rows: Array, count: int) -> Array:
    """Adds up rows by label, `[count, d]`."""
    return np.column_stack([sums(labels, column, count) for column in rows.T])


def means(labels: Ints, rows: Array, weights: Array, count: int) -> Array:
    """Returns weighted means of rows by label, `[count, d]`, 0 where there are none."""
    totals = sums(labels, weights, count)
    return columns(labels, weights[:, None] * rows, count) / np.where(totals > 0, totals, 1)[:, None]
