"""Tasks that cut arrays into cells and find the rims of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from operator import getitem
from typing import Any

import dask
import dask.array as da
from dask.base import tokenize
from dask.delayed import Delayed
from dask.highlevelgraph import HighLevelGraph

from . import parts
from .plan import Plan, blocks_of


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
