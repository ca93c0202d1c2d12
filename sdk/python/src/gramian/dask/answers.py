"""Answers of tiles: Dask arrays in the order of the points, or of the queries.

n is the number of points of the cloud, d their dimension, m the number of queries. L is the unit of the coordinates
and V that of the values. Nothing is computed until Dask is asked to: `dask.compute(answer)` returns the same object
with NumPy arrays, and computes each tile once for all of its arrays.

`reasons` says in a word why an answer is missing or doubtful, `[n]`, as in `gramian.FlagReason`.
`uncertain_orientation` stands where the side of the surface is nearly a matter of chance, and nothing for all others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, TypeVar

import dask.array as da
import numpy as np
from scipy.sparse import csr_matrix

from ..arguments.arrays import read
from ..wire.tensors import Array

T = TypeVar("T", bound="Normals | Interpolation")


@dataclass(frozen=True, eq=False)
class Normals:
    """Unit normals of the surface at the points, NaN where there are none. Deviations are None unless asked for.

    Attributes
    ----------
    normals
        `[n, d]`, of length 1, outward.
    levels
        `[n]`. 1 minus the height of the point above the surface, L.
    normal_std
        `[n]`, radians. Standard deviation of the angle of the normal: 95 % of the angles lie within 1.96 of it.
    reasons
        `[n]`, text.
    """

    normals: da.Array
    levels: da.Array
    normal_std: da.Array | None
    reasons: da.Array


@dataclass(frozen=True, eq=False)
class Curvatures(Normals):
    """Normals and curvatures of the surface at the points. With outward normals a sphere of radius r has +1/r.

    Attributes
    ----------
    principal_curvatures
        `[n, d − 1]`, 1/L, ascending. `principal_directions`, `[n, d − 1, d]`, are theirs, of length 1.
    mean_curvatures
        `[n]`, 1/L. The average of the principal curvatures.
    gaussian_curvatures
        `[n]`, 1/L^(d − 1). Their product.
    principal_curvature_std, mean_curvature_std, gaussian_curvature_std
        Standard deviations of these, in the same shapes.
    """

    principal_curvatures: da.Array
    principal_directions: da.Array
    mean_curvatures: da.Array
    gaussian_curvatures: da.Array
    principal_curvature_std: da.Array | None
    mean_curvature_std: da.Array | None
    gaussian_curvature_std: da.Array | None


@dataclass(frozen=True, eq=False)
class Interpolation:
    """A function u through the values, kriged at each query from the points nearest to it. None is what was not asked.

    Attributes
    ----------
    values
        `[m]`, V. u at each query.
    gradients
        `[m, d]`, V/L. ∇u, with `derivatives` of 1 or 2.
    hessians
        `[m, d, d]`, V/L². D²u, with `derivatives` of 2.
    value_std, gradient_std, hessian_std
        Standard deviations of these given the values, of the same shapes, with `std`.
    """

    values: da.Array
    gradients: da.Array | None
    hessians: da.Array | None
    value_std: da.Array | None
    gradient_std: da.Array | None
    hessian_std: da.Array | None


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
        `[n]`, text.
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


def named(kind: type[T], found: Mapping[str, Any]) -> T:
    """Makes an answer of its arrays by name. Those that are absent are None."""
    return kind(**{field.name: found.get(field.name) for field in fields(kind)})


def _product(rows: csr_matrix, values: Array) -> Array:
    product: Array = rows @ read("values", values)
    return product
