"""Points in space as discs in a picture, the nearer ones before the others.

matplotlib's own axes in three dimensions sort whole artists, so they show points through surfaces. Here every
pixel has the disc that is nearest.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..wire.tensors import Array

AT_ONCE = 2_000_000
"""Pixels of discs that are drawn at a time."""

AMBIENT = 0.55
"""Brightness of what is turned away from the light, which comes from the viewer."""


def camera(elevation: float, azimuth: float) -> Array:
    """Returns the axes of a picture as rows: right, up, towards the viewer. Angles are in degrees, z is up."""
    up, around = np.radians([elevation, azimuth])
    towards = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
    right = np.array([-np.sin(around), np.cos(around), 0.0])
    return np.array([right, np.cross(towards, right), towards])


def shaded(colours: Array, normals: Array | None, axes: Array) -> Array:
    """Returns colours darker where the surface is seen from the side."""
    if normals is None:
        return colours
    facing = np.nan_to_num(np.abs(normals @ axes[2]), nan=1.0)
    dark: Array = colours * (AMBIENT + (1 - AMBIENT) * facing)[:, None]
    return dark


def splatted(
    places: Array, colours: Array, radius: float, width: int
) -> tuple[Array, tuple[float, float, float, float]]:
    """Draws discs.

    Parameters
    ----------
    places
        `[m, 3]`: right, up, towards the viewer.
    colours
        `[m, 3]`.
    radius
        Radius of the discs, in the unit of the places.
    width
        Pixels of the longer side.

    Returns
    -------
    image
        `[height, width, 4]`, transparent where there is no disc. The first row is the lowest.
    extent
        Left, right, bottom and top of the image, in the unit of the places.
    """
    low, high = places[:, :2].min(axis=0) - radius, places[:, :2].max(axis=0) + radius
    pixel = float((high - low).max()) / width or 1.0
    n_columns, n_rows = np.maximum(np.ceil((high - low) / pixel).astype(int), 1)
    column, row = ((places[:, :2] - low) / pixel).astype(int).T
    winner = np.full(n_columns * n_rows, -1)
    steps = _disc(max(int(np.ceil(radius / pixel)), 1), radius / pixel)
    order = np.argsort(places[:, 2], kind="stable")
    at_once = max(1, AT_ONCE // len(steps))
    # From far to near: of equal pixels, the last assignment stays.
    for start in range(0, len(order), at_once):
        some = order[start : start + at_once]
        rows = np.clip(row[some][:, None] + steps[:, 1], 0, n_rows - 1)
        columns = np.clip(column[some][:, None] + steps[:, 0], 0, n_columns - 1)
        winner[(rows * n_columns + columns).ravel()] = np.repeat(some, len(steps))
    image = np.zeros((n_rows * n_columns, 4))
    image[winner >= 0, :3] = colours[winner[winner >= 0]]
    image[winner >= 0, 3] = 1.0
    extent = (float(low[0]), float(low[0] + n_columns * pixel), float(low[1]), float(low[1] + n_rows * pixel))
    return image.reshape(n_rows, n_columns, 4), extent


def _disc(reach: int, radius: float) -> npt.NDArray[np.int64]:
    """Returns steps to the pixels of a disc, `[s, 2]`."""
    steps = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)
    within: npt.NDArray[np.int64] = steps[(steps**2).sum(axis=1) <= max(radius, 0.5) ** 2]
    return within
