"""Tasks that cut arrays into cells, find the rims of these, and put rows of tiles into the order of the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from operator import getitem
from typing import Any, TypeAlias

import dask
import dask.array as da
import numpy as np
from dask.base import tokenize
from dask.delayed import Delayed
from dask.highlevelgraph import HighLevelGraph
from scipy.sparse import csr_matrix, vstack

from . import parts
from .plan import Plan, blocks_of

Rows: TypeAlias = dict[str, Any]
"""Arrays by name, with a row for each of `index`, the rows of a cloud or of queries, ascending."""


def many(tasks: Mapping[Any, Any], wanted: Sequence[Any], dependencies: Sequence[Delayed]) -> list[Delayed]:
    """Returns the results of some of many tasks, delayed; delayed functions would take milliseconds for each of them.

    `tasks` has a function with its arguments for each key, whose first part is the name of all. Arguments may be keys,
    also those of `dependencies`.
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


def gathered(tiles: Sequence[Any], chunks: Sequence[int], kinds: Mapping[str, Any]) -> dict[str, da.Array]:
    """Returns Dask arrays in blocks of so many rows, from the `Rows` of tiles, which together have each row once.

    `kinds` has for each name an array without rows, of the type and the further axes that it is to have.
    """
    cells = range(len(tiles))
    bounds = np.concatenate([[0], np.cumsum(chunks)]).tolist()
    ranges = list(enumerate(pairwise(bounds)))
    name = f"rows-{tokenize([tile.key for tile in tiles], bounds, sorted(kinds))}"
    tasks: dict[Any, Any] = {
        (name, at, cell): (_between, tile.key, *range_) for at, range_ in ranges for cell, tile in enumerate(tiles)
    }
    tasks |= {
        (name, at): (partial(_in_order, first=first, last=last, kinds=kinds), [(name, at, cell) for cell in cells])
        for at, (first, last) in ranges
    }
    blocks = many(tasks, [(name, at) for at, _ in ranges], tiles)
    take = dask.delayed(getitem, pure=True)

    def of(name: str, kind: Any) -> da.Array:  # noqa: ANN401 (NumPy's or SciPy's)
        sizes = zip(chunks, blocks, strict=True)
        parts = [da.from_delayed(take(block, name), (size, *kind.shape[1:]), meta=kind) for size, block in sizes]
        return da.concatenate(parts, axis=0)

    return {name: of(name, kind) for name, kind in kinds.items()}


def _between(rows: Rows, first: int, last: int) -> Rows:
    """Returns the rows from this one to that one."""
    if not rows:
        return rows
    start, end = np.searchsorted(rows["index"], [first, last]).tolist()
    return {name: array[start:end] for name, array in rows.items()} if end > start else {}


def _in_order(parts: Sequence[Rows], first: int, last: int, kinds: Mapping[str, Any]) -> Rows:
    """Puts rows of tiles into the order of the input. Raises `RuntimeError` if they are not all there."""
    found = [part for part in parts if part]
    index = np.concatenate([part["index"] for part in found]) if found else np.arange(0)
    order = np.argsort(index)
    if not np.array_equal(index[order], np.arange(first, last)):
        raise RuntimeError(
            f"the tiles have {len(index)} of the rows {first} to {last}: the points have changed meanwhile"
        )
    rows: Rows = {}
    for name, kind in kinds.items():
        arrays = [part[name] for part in found]
        if isinstance(kind, csr_matrix):
            rows[name] = vstack([*arrays, kind], format="csr")[order]
        else:
            rows[name] = np.concatenate([*arrays, kind])[order]
    return rows
