"""Requests to a replica for the surface of a tile. They run in tasks of Dask, and may be repeated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix

from ..answers import Curvatures, Normals
from ..client import Client
from ..rest.models import Flag
from ..tiles.replicas import Replicas
from ..wire.tensors import Array
from .cells.cut import Ints
from .cells.graph import Rows
from .surface import Sides, SurfaceTile, Whole

NO_REASONS = np.empty(0, dtype="U24")

UNCERTAIN_ORIENTATION = "uncertain_orientation"
"""The side of a connected piece is nearly a matter of chance."""

NOT_PER_POINT = ("surface_models", "gradient_norms", "flags", "diagnostics", "fit")
"""Members of answers that tiles do not have."""


def surface(replicas: Replicas, tile: SurfaceTile, sides: Sides, whole: Whole, what: str, std: bool) -> Rows:
    """Asks for normals or curvatures at the points of a cell. `sides` are those of the regions of its tile."""
    if len(tile.own) == 0:
        return {}

    def call(client: Client) -> Normals | Curvatures:
        cloud = client.cloud(tile.part.points, tile.directions)
        ask = cloud.normals if what == "normals" else cloud.curvatures
        return ask(solver="local", std=std, hyperparameters=whole.hyperparameters)

    answer = replicas.ask(tile.number, call)
    labels, (signs, are_doubtful) = tile.labels[tile.own], sides
    reasons = _reasons(answer.flags, tile)
    reasons[(reasons == "") & are_doubtful[labels]] = UNCERTAIN_ORIENTATION
    arrays = {name: array for name, array in vars(answer).items() if name not in NOT_PER_POINT and array is not None}
    return {"index": tile.rows, "reasons": reasons, **_turned(arrays, tile.own, signs[labels])}


def operator(replicas: Replicas, tile: SurfaceTile, whole: Whole, what: str, n_points: int) -> Rows:
    """Asks for the rows of an operator at the points of a cell, with the points of the cloud as columns."""
    if len(tile.own) == 0:
        return {}

    def call(client: Client) -> tuple[Sequence[csr_matrix], tuple[Flag, ...]]:
        cloud, known = client.cloud(tile.part.points, tile.directions), whole.hyperparameters
        if what == "laplace_beltrami":
            of_values = cloud.laplace_beltrami_sparse_matrix(solver="local", hyperparameters=known)
            return [of_values.matrix], of_values.flags
        of_gradients = cloud.surface_gradient_sparse_matrix(solver="local", hyperparameters=known)
        return of_gradients.matrices, of_gradients.flags

    matrices, flags = replicas.ask(tile.number, call)
    rows: Rows = {"index": tile.rows, "reasons": _reasons(flags, tile)}
    for component, matrix in enumerate(matrices):
        own = matrix[tile.own]
        entries = (own.data, tile.part.index[own.indices], own.indptr)
        whole_rows = csr_matrix(entries, shape=(len(tile.own), n_points))
        whole_rows.sort_indices()
        rows[f"matrix {component}"] = whole_rows
    return rows


def _turned(arrays: Mapping[str, Array], rows: Ints, signs: Array) -> dict[str, Array]:
    """Returns these rows of the arrays of an answer for normals with these signs."""
    turned = signs < 0
    found = {name: array[rows] for name, array in arrays.items()}
    dimension = found["normals"].shape[1]
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


def _reasons(flags: tuple[Flag, ...], tile: SurfaceTile) -> npt.NDArray[np.str_]:
    """Returns why answers at the points of the cell are doubtful."""
    reasons = np.zeros(len(tile.part), dtype=NO_REASONS.dtype)
    reasons[[entry.query for entry in flags]] = [entry.reason.value for entry in flags]
    return reasons[tile.own]
