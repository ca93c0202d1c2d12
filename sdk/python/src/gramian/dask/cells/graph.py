"""Tasks that cut arrays into cells and find the rims of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from operator import getitem
from typing import Any

import dask
import dask.array as da
import numpy as np
import numpy.typing as npt
from dask.base import tokenize
from dask.delayed import Delayed
from dask.highlevelgraph import HighLevelGraph

from ...arguments.arrays import as_array, as_block
from ...wire.tensors import Array
from . import parts
from .plan import Plan, blocks_of

BLOCK_POINTS = 250_000
"""Rows of the blocks of arrays that are given without any."""


def rows_of(points: npt.ArrayLike | da.Array, name: str = "points", dimension: int | None = None) -> da.Array:
    """Returns an array `[n, d]` in blocks of rows of known sizes, which are looked at when they are computed.

    With a dimension, d is to be that.

    Raises
    ------
    TypeError
        If it has something else than real numbers.
    ValueError
        If it has another shape, or a number that cannot be sent.
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
    """Returns values `[n]` in the blocks of the points, looked at as these are.

    Raises
    ------
    TypeError
        If they are something else than real numbers.
    ValueError
        If there is not one for each, or one cannot be sent.
    """
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


def many(tasks: Mapping[Any, Any], wanted: Sequence[Any], dependencies: Sequence[Delayed]) -> list[Delayed]:
    """Returns the results of some of many tasks, delayed; delayed functions would take milliseconds for each of them.

    Parameters
    ----------
    tasks : mapping
        Of each key, whose first part is the name of all, a function with its arguments: keys and lists of them, too.
    wanted : sequence
        Keys.
    dependencies : sequence of Delayed
        Those whose keys are arguments.
    """
    name = wanted[0][0]
    graph = HighLevelGraph.from_collections(name, tasks, dependencies=dependencies)
    return [Delayed(key, graph, layer=name) for key in wanted]


def cores(points: da.Array, plan: Plan, values: da.Array | None = None) -> list[Delayed]:
    """Returns the part of each cell, delayed."""
    split, cut = dask.delayed(parts.split, pure=True), dask.delayed(plan.cut, pure=True)
    blocks = blocks_of(points)
    beside = [None] * len(blocks) if values is None else [block for block, _ in blocks_of(values)]
    pieces = [split(block, first, cut, own) for (block, first), own in zip(blocks, beside, strict=True)]
    cells = range(plan.cut.n_cells)
    name = f"core-{tokenize([piece.key for piece in pieces])}"
    tasks: dict[Any, Any] = {
        (name, cell, at): (getitem, piece.key, cell) for at, piece in enumerate(pieces) for cell in cells
    }
    tasks |= {(name, cell): (parts.join, [(name, cell, at) for at in range(len(pieces))]) for cell in cells}
    return many(tasks, [(name, cell) for cell in cells], pieces)


def rims(
    own: Sequence[Delayed], plan: Plan, reach: parts.Reach, queries: Sequence[Delayed] | None = None
) -> list[Delayed]:
    """Returns for each cell a list of what it needs of the others, delayed: those nearest to its points, or queries."""
    look, cut = dask.delayed(parts.look, pure=True), dask.delayed(plan.cut, pure=True)
    cells = range(len(own))
    wanted = [None] * len(own) if queries is None else list(queries)
    looking = [look(own[cell], cell, cut, reach, wanted[cell]) for cell in cells]
    name = f"rim-{tokenize([part.key for part in (*own, *looking)], reach)}"
    rim = partial(parts.rim, reach=reach)
    tasks: dict[Any, Any] = {
        (name, cell, at): (rim, own[at].key, looking[cell].key) for cell in cells for at in cells if at != cell
    }
    tasks |= {(name, cell): (list, [(name, cell, at) for at in cells if at != cell]) for cell in cells}
    return many(tasks, [(name, cell) for cell in cells], [*own, *looking])
