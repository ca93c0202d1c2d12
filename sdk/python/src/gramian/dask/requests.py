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
from ..wire.tensors import Array
from .cells.cut import Ints
from .orientation.signs import Sides
from .replicas import Replicas
from .settling import Settled

Rows: TypeAlias = dict[str, Any]
"""Arrays by name with a row for each of `index`, the rows of a cloud or of queries, ascending."""

REASON = "U24"

OTHER_HYPERPARAMETERS = "other_hyperparameters"
"""The tile learned something else than the cloud."""

UNCERTAIN_ORIENTATION = "uncertain_orientation"
"""What says which side of a connected piece is outward says little."""


def surface(replicas: Replicas, settled: Settled, sides: Sides, what: str, deviations: bool) -> Rows:
    """Asks for normals or curvatures at the points of a cell; `sides` are those of its regions."""
    tile = settled.tile
    if len(tile.own) == 0:
        return {}

    def call(client: Client) -> Normals | Curvatures:
        cloud = settled.cloud(client)
        ask = cloud.normals if what == "normals" else cloud.curvatures
        return ask(solver="local", deviations=deviations, sites=settled.sites)

    answer = replicas.ask(tile.number, call)
    reasons = _reasons(answer.degenerate, settled)
    reasons[(reasons == "") & sides.are_doubtful[settled.labels[tile.own]]] = UNCERTAIN_ORIENTATION
    turned = _turned(_arrays(answer), sides.signs[settled.labels], answer.normals.shape[1], tile.own)
    return {"index": tile.rows, "reasons": reasons, **turned}


def operator(replicas: Replicas, settled: Settled, what: str, n_points: int) -> Rows:
    """Asks for the rows of an operator at the points of a cell, with the points of the cloud as columns."""
    tile = settled.tile
    if len(tile.own) == 0:
        return {}

    def call(client: Client) -> tuple[list[csr_matrix], tuple[Degenerate, ...]]:
        cloud = settled.cloud(client)
        if what == "laplace_beltrami":
            of_values = cloud.laplace_beltrami_sparse_matrix(solver="local", sites=settled.sites)
            return [of_values.matrix], of_values.degenerate
        of_gradients = cloud.surface_gradient_sparse_matrix(solver="local", sites=settled.sites)
        return list(of_gradients.matrices), of_gradients.degenerate

    matrices, degenerate = replicas.ask(tile.number, call)
    rows: Rows = {"index": tile.rows, "reasons": _reasons(degenerate, settled)}
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


def _reasons(degenerate: tuple[Degenerate, ...], settled: Settled) -> npt.NDArray[np.str_]:
    """Returns why answers at the points of the cell are doubtful; what the service says of one comes first."""
    reasons = np.zeros(len(settled.tile.points), dtype=REASON)
    reasons[[entry.query for entry in degenerate]] = [entry.reason.value for entry in degenerate]
    if not settled.is_alike:
        reasons[reasons == ""] = OTHER_HYPERPARAMETERS
    return reasons[settled.tile.own]
