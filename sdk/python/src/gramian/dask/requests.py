"""What is asked of a replica for a tile. All of it runs in tasks of Dask, and may be repeated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix

from ..answers import Curvatures, Normals
from ..client import Client
from ..rest.models import Degenerate
from ..tensors import Array
from .cut import Ints
from .replicas import Replicas
from .settling import Settled

Rows: TypeAlias = dict[str, Any]
"""Arrays by name with a row for each of `index`, the rows of a cloud or of queries, ascending."""

REASON = "U24"


def surface(replicas: Replicas, settled: Settled, sides: Array, what: str, deviations: bool) -> Rows:
    """Asks for normals or curvatures at the points of a cell; `sides` are the signs of its regions."""
    tile = settled.tile
    if len(tile.own) == 0:
        return {}

    def call(client: Client) -> Normals | Curvatures:
        cloud = settled.cloud(client)
        ask = cloud.normals if what == "normals" else cloud.curvatures
        return ask(solver="local", deviations=deviations)

    answer = replicas.ask(tile.number, call)
    rows: Rows = {"index": tile.rows, "reasons": _reasons(answer.degenerate, len(tile.points))[tile.own]}
    rows |= _turned(_arrays(answer), sides[settled.labels], answer.normals.shape[1], tile.own)
    return rows


def operator(replicas: Replicas, settled: Settled, what: str, n_points: int) -> Rows:
    """Asks for the rows of an operator at the points of a cell, with the points of the cloud as columns."""
    tile = settled.tile
    if len(tile.own) == 0:
        return {}

    def call(client: Client) -> tuple[list[csr_matrix], tuple[Degenerate, ...]]:
        cloud = settled.cloud(client)
        if what == "laplace_beltrami":
            of_values = cloud.laplace_beltrami_sparse_matrix(solver="local")
            return [of_values.matrix], of_values.degenerate
        of_gradients = cloud.surface_gradient_sparse_matrix(solver="local")
        return list(of_gradients.matrices), of_gradients.degenerate

    matrices, degenerate = replicas.ask(tile.number, call)
    rows: Rows = {"index": tile.rows, "reasons": _reasons(degenerate, len(tile.points))[tile.own]}
    for component, matrix in enumerate(matrices):
        own = matrix[tile.own]
        entries = (own.data, tile.index[own.indices], own.indptr)
        whole = csr_matrix(entries, shape=(len(tile.own), n_points))
        whole.sort_indices()
        rows[f"matrix {component}"] = whole
    return rows


def _arrays(answer: Normals | Curvatures) -> dict[str, Array]:
    """Returns what an answer has for each query, by name."""
    left_out = ("surfaces", "gradient_norms", "degenerate", "diagnostics", "fit")
    return {name: array for name, array in vars(answer).items() if name not in left_out and array is not None}


def _turned(arrays: Mapping[str, Array], signs: Array, dimension: int, rows: Ints) -> dict[str, Array]:
    """Returns these rows of the arrays of an answer for normals with these signs."""
    turned = signs[rows] < 0
    found = {name: array[rows] for name, array in arrays.items()}
    for name, array in found.items():
        if name.startswith("principal"):
            array[turned] = array[turned][:, ::-1]
        if name in ("normals", "principal_curvatures", "mean_curvatures"):
            array[turned] *= -1
        if name == "gaussian_curvatures":
            array[turned] *= (-1.0) ** (dimension - 1)
        if name == "levels":
            array[turned] = 2 - array[turned]
    return found


def _reasons(degenerate: tuple[Degenerate, ...], count: int) -> npt.NDArray[np.str_]:
    reasons = np.zeros(count, dtype=REASON)
    reasons[[entry.query for entry in degenerate]] = [entry.reason.value for entry in degenerate]
    return reasons
