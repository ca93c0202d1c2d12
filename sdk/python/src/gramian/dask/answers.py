"""Answers of tiles: Dask arrays in the order of the points, or of the queries.

n is the number of points of the cloud, d their dimension, m the number of queries; L is the unit of the coordinates and
V that of the values. Nothing is computed until Dask is asked to: `dask.compute(answer)` returns the same object with
NumPy arrays, and computes each tile once for all of its arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import dask.array as da
import numpy as np
from scipy.sparse import csr_matrix

from ..arguments.arrays import read
from ..wire.tensors import Array


@dataclass(frozen=True, eq=False)
class Normals:
    """Unit normals of the surface at the points. Deviations are None unless asked for.

    Attributes
    ----------
    normals
        `[n, d]`, of length 1, outward; NaN where there is none.
    levels
        `[n]`. 1 minus the height of the point above the surface, L.
    normal_deviations
        `[n]`, radians. Standard deviation of the angle of the normal: 95 % of the angles lie within 1.96 of it.
    reasons
        `[n]`, text: why a point has no normal or a doubtful one, as in `gramian.DegenerateReason`;
        `uncertain_orientation` where its side is nearly a matter of chance, `other_hyperparameters` where its tile
        learned something else than the cloud; empty for all others.
    """

    normals: da.Array
    levels: da.Array
    normal_deviations: da.Array | None
    reasons: da.Array


@dataclass(frozen=True, eq=False)
class Curvatures:
    """Curvatures of the surface at the points: with outward normals, a sphere of radius r has +1/r everywhere.

    Deviations are None unless asked for. Numbers are NaN where there are none.

    Attributes
    ----------
    principal_curvatures
        `[n, d − 1]`, 1/L, ascending.
    principal_directions
        `[n, d − 1, d]`, of length 1.
    mean_curvatures
        `[n]`, 1/L. The average of the principal curvatures.
    gaussian_curvatures
        `[n]`, 1/L^(d − 1). Their product.
    normals
        `[n, d]`, of length 1, outward.
    levels
        `[n]`. 1 minus the height of the point above the surface, L.
    normal_deviations
        `[n]`, radians. Standard deviation of the angle of the normal.
    principal_curvature_deviations
        `[n, d − 1]`, 1/L. Standard deviations of the principal curvatures.
    mean_curvature_deviations
        `[n]`, 1/L.
    gaussian_curvature_deviations
        `[n]`, 1/L^(d − 1).
    reasons
        `[n]`, text: why a point has no curvatures or doubtful ones, as in `gramian.DegenerateReason`;
        `uncertain_orientation` where its side is nearly a matter of chance, `other_hyperparameters` where its tile
        learned something else than the cloud; empty for all others.
    """

    principal_curvatures: da.Array
    principal_directions: da.Array
    mean_curvatures: da.Array
    gaussian_curvatures: da.Array
    normals: da.Array
    levels: da.Array
    normal_deviations: da.Array | None
    principal_curvature_deviations: da.Array | None
    mean_curvature_deviations: da.Array | None
    gaussian_curvature_deviations: da.Array | None
    reasons: da.Array


@dataclass(frozen=True, eq=False)
class Interpolation:
    """A function u through the values, kriged at each query from the points nearest to it; None is what was not asked.

    Attributes
    ----------
    values
        `[m]`, V. u at each query.
    gradients
        `[m, d]`, V/L. ∇u, with `derivatives` of 1 or 2.
    hessians
        `[m, d, d]`, V/L². D²u, with `derivatives` of 2.
    value_deviations, gradient_deviations, hessian_deviations
        Standard deviations of these given the values, of the same shapes, with `deviations`.
    """

    values: da.Array
    gradients: da.Array | None
    hessians: da.Array | None
    value_deviations: da.Array | None
    gradient_deviations: da.Array | None
    hessian_deviations: da.Array | None


@dataclass(frozen=True, eq=False)
class SparseOperator:
    """An operator on the surface, as sparse matrices that turn values at the points into what it makes of them.

    Attributes
    ----------
    matrices
        One for the Laplace–Beltrami operator, 1/L²; d for the surface gradient, one for each coordinate, 1/L. Each is
        `[n, n]`, a Dask array whose blocks are rows as `scipy.sparse.csr_matrix`; `compute()` makes one matrix of them.
        Rows have no entries where there is no value.
    reasons
        `[n]`, text: why a row is empty or doubtful, as in `gramian.DegenerateReason`, or `other_hyperparameters`
        where its tile learned something else than the cloud; "" for all others.
    """

    matrices: tuple[da.Array, ...]
    reasons: da.Array

    def apply(self, values: da.Array) -> tuple[da.Array, ...]:
        """Multiplies the matrices with values `[n]` at the points, V, a NumPy or Dask array; an array `[n]` for each.

        Every block of rows sees all values, so these are to fit into memory.
        """
        array = values if isinstance(values, da.Array) else da.from_array(read("values", values))
        whole = array.rechunk(-1)
        return tuple(
            da.map_blocks(_product, matrix, whole, drop_axis=1, dtype=float, meta=np.empty(0))
            for matrix in self.matrices
        )


def _product(rows: csr_matrix, values: Array) -> Array:
    product: Array = rows @ read("values", values)
    return product
