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

from . import parts
from .plan import Plan, blocks_of

BLOCK_POINTS = 250_000
"""Rows of the blocks of arrays that are given without any."""


def rows_of(points: npt.ArrayLike | da.Array) -> da.Array:
    """Returns an array `[n, d]` in blocks of rows of known sizes.

    Raises
    ------
    ValueError
        If it has another shape.
    """
    array = points if isinstance(points, da.Array) else np.asarray(points, dtype=np.float64)
    if array.ndim != 2:
        raise ValueError(f"points must have the shape [n, d], not {list(array.shape)}: rows are points")
    if not isinstance(array, da.Array):
        array = da.from_array(array, (BLOCK_POINTS, -1))
    if np.isnan(array.shape).any():
        array = array.compute_chunk_sizes()
    if len(array) == 0:
        raise ValueError("points has no rows")
    return array.rechunk({1: -1})


def aligned(values: npt.ArrayLike | da.Array, points: da.Array) -> da.Array:
    """Returns values `[n]` in the blocks of the points.

    Raises
    ------
    ValueError
        If there is not one for each.
    """
    array = da.asarray(values)
    if array.ndim == 1 and np.isnan(array.shape[0]):
        array = array.compute_chunk_sizes()
    if array.shape != points.shape[:1]:
        raise ValueError(f"values must have the shape [n] = [{len(points)}], not {list(array.shape)}")
    return array.rechunk((points.chunks[0],)).astype(np.float64)


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
