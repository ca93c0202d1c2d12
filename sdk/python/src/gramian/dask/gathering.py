"""From rows of tiles to Dask arrays in the order of the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import dask
import dask.array as da
import numpy as np
from dask.base import tokenize
from scipy.sparse import csr_matrix, vstack

from .cells.graph import many
from .requests import Rows


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
    take = dask.delayed(_take, pure=True)

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


def _take(rows: Rows, name: str) -> Any:  # noqa: ANN401 (NumPy's or SciPy's)
    return rows[name]
