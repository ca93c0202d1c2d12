"""Arrays of Dask as arguments: in blocks of rows that are looked at when they are computed."""

from __future__ import annotations

from typing import Any

import dask.array as da
import numpy as np
import numpy.typing as npt

from ..wire.tensors import Array
from .arrays import as_array, as_block

BLOCK_POINTS = 250_000
"""Rows of the blocks of arrays that are given without any."""


def rows_of(points: npt.ArrayLike | da.Array, name: str = "points", dimension: int | None = None) -> da.Array:
    """Returns an array `[n, d]` in blocks of rows of known sizes, which are looked at when they are computed.

    With a dimension, d is to be that. Raises `TypeError` for anything but real numbers, and `ValueError` for another
    shape and for numbers that cannot be sent.
    """
    if not isinstance(points, da.Array):
        known = {} if dimension is None else {"d": dimension}
        return da.from_array(as_array(name, points, ["n", "d"], known), (BLOCK_POINTS, -1))
    if points.ndim != 2 or points.shape[1] != (dimension or points.shape[1]):
        shape = f"[n, {dimension or 'd'}]"
        raise ValueError(f"{name} must have the shape {shape}, not {list(points.shape)}: rows are points")
    array = points.compute_chunk_sizes() if np.isnan(points.shape).any() else points
    if len(array) == 0:
        raise ValueError(f"{name} has no rows")
    return looked_at(array.rechunk({1: -1}), name)


def aligned(values: npt.ArrayLike | da.Array, points: da.Array) -> da.Array:
    """Returns values `[n]` in the blocks of the points, refused as these are, or if there is not one for each."""
    if not isinstance(values, da.Array):
        return da.from_array(as_array("values", values, ["n"], {"n": len(points)}), (points.chunks[0],))
    array = values.compute_chunk_sizes() if values.ndim == 1 and np.isnan(values.shape[0]) else values
    if array.shape != points.shape[:1]:
        raise ValueError(f"values must have the shape [n] = [{len(points)}], not {list(array.shape)}")
    return looked_at(array.rechunk((points.chunks[0],)), "values")


def looked_at(array: da.Array, name: str) -> da.Array:
    """Returns an array in float64 whose blocks of rows are refused for what cannot be sent, by its place in all."""
    meta = np.empty((0,) * array.ndim)
    return array.map_blocks(_block, called=name, dtype=np.float64, meta=meta)


def _block(block: Any, called: str, block_info: Any = None) -> Array:  # noqa: ANN401 (of any kind)
    return as_block(called, block, block_info[0]["array-location"][0][0])
