"""Operators on the surface that the points of a cloud sample, applied to values or as matrices."""

from __future__ import annotations

from typing import Unpack

import numpy.typing as npt

from ..answers import (
    LaplaceBeltrami,
    LaplaceBeltramiMatrix,
    LaplaceBeltramiSparseMatrix,
    SurfaceGradient,
    SurfaceGradientMatrix,
    SurfaceGradientSparseMatrix,
)
from ..answers.sparse import require_scipy
from ..arguments.keywords import suggest_names
from ..arguments.normalise import GEOMETRIC
from ..arguments.options import OperatorFit, OperatorOptions, SurfaceOperatorFit
from ..arguments.registration import RegisteredCloud


@suggest_names
class OperatorsOnCloud(RegisteredCloud):
    """The part of `Cloud` that concerns operators on the surface of its points. V is the unit of values."""

    def surface_gradient(
        self, values: npt.ArrayLike, queries: npt.ArrayLike | None = None, **options: Unpack[OperatorOptions]
    ) -> SurfaceGradient:
        """Computes the tangential part ∇u − (∇u·ν)ν of the gradient of the function through values.

        `gramian.OperatorOptions` describes the options.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.

        Returns
        -------
        SurfaceGradient
            `gradients` at the queries, NaN where there is none. `flags` says why.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> circle.surface_gradient(np.cos(angles), [[0.8, 0.6]], kernel=kernel).gradients.round(3)
        array([[ 0.36, -0.48]])
        """
        return self._compute(
            SurfaceGradient.read, "/v1/surface-gradient", GEOMETRIC, values=values, queries=queries, **options
        )

    def surface_gradient_matrix(
        self, queries: npt.ArrayLike | None = None, **options: Unpack[OperatorFit]
    ) -> SurfaceGradientMatrix:
        """Assembles the matrices, one per coordinate, that turn values at the points into surface gradients.

        There are no values to learn from. If absent, `kernel` is chosen from the cloud, `alpha` is 1e-10 and
        `mean` is zero. With a constant mean the matrix maps constants exactly to 0. The solver is dense.
        `gramian.OperatorFit` describes the options.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.

        Returns
        -------
        SurfaceGradientMatrix
            `matrices`, `[d, m, n]`. Rows are NaN where there is no gradient, and `flags` says why.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> answer = circle.surface_gradient_matrix([[0.8, 0.6]], kernel=kernel)
        >>> answer.matrices.shape, (answer.matrices @ np.cos(angles)).round(3).T
        ((2, 1, 8), array([[ 0.36, -0.48]]))
        """
        return self._compute(SurfaceGradientMatrix.read, "/v1/surface-gradient/matrix", queries=queries, **options)

    def surface_gradient_sparse_matrix(
        self, queries: npt.ArrayLike | None = None, **options: Unpack[SurfaceOperatorFit]
    ) -> SurfaceGradientSparseMatrix:
        """Assembles sparse matrices, one per coordinate, that map values to surface gradients.

        The weights come from the points near each query, without a kernel for the values. `kernel` and
        `alpha` are those of the surface. Works for any number of points. Needs SciPy.
        `gramian.SurfaceOperatorFit` describes the options.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.

        Returns
        -------
        SurfaceGradientSparseMatrix
            `matrices`, d matrices of type `scipy.sparse.csr_matrix` and shape `[m, n]`. Rows have no entries
            where there is no gradient, and `flags` says why.

        Raises
        ------
        ModuleNotFoundError
            If SciPy is not installed.

        Examples
        --------
        >>> angles = np.arange(100) * np.pi / 50
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> answer = circle.surface_gradient_sparse_matrix([[0.8, 0.6]], solver="local")
        >>> [matrix.shape for matrix in answer.matrices]
        [(1, 100), (1, 100)]
        >>> np.array([matrix @ np.cos(angles) for matrix in answer.matrices]).round(2).T
        array([[ 0.36, -0.48]])
        """
        require_scipy()
        return self._compute(
            SurfaceGradientSparseMatrix.read, "/v1/surface-gradient/sparse-matrix", queries=queries, **options
        )

    def laplace_beltrami(
        self, values: npt.ArrayLike, queries: npt.ArrayLike | None = None, **options: Unpack[OperatorOptions]
    ) -> LaplaceBeltrami:
        """Applies the Laplace–Beltrami operator to the function through values.

        On the unit circle Δ cos θ = −cos θ. `gramian.OperatorOptions` describes the options.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.

        Returns
        -------
        LaplaceBeltrami
            `values` of Δu at the queries, NaN where there is none. `flags` says why.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> circle.laplace_beltrami(np.cos(angles), [[0.8, 0.6]], kernel=kernel).laplacians.round(3)
        array([-0.8])
        """
        return self._compute(
            LaplaceBeltrami.read, "/v1/laplace-beltrami", GEOMETRIC, values=values, queries=queries, **options
        )

    def laplace_beltrami_matrix(
        self, queries: npt.ArrayLike | None = None, **options: Unpack[OperatorFit]
    ) -> LaplaceBeltramiMatrix:
        """Assembles the matrix that turns values at the points into Δu at the queries.

        There are no values to learn from. If absent, `kernel` is chosen from the cloud, `alpha` is 1e-10 and
        `mean` is zero. With a constant mean the matrix maps constants exactly to 0. The solver is dense.
        `gramian.OperatorFit` describes the options.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.

        Returns
        -------
        LaplaceBeltramiMatrix
            `matrix`, `[m, n]`. Rows are NaN where there is no value, and `flags` says why.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> answer = circle.laplace_beltrami_matrix(kernel=kernel)
        >>> answer.matrix.shape, (answer.matrix @ np.cos(angles)).round(3)[0]
        ((8, 8), np.float64(-1.0))
        """
        return self._compute(LaplaceBeltramiMatrix.read, "/v1/laplace-beltrami/matrix", queries=queries, **options)

    def laplace_beltrami_sparse_matrix(
        self, queries: npt.ArrayLike | None = None, **options: Unpack[SurfaceOperatorFit]
    ) -> LaplaceBeltramiSparseMatrix:
        """Assembles the sparse matrix that turns values at the points into Δu at the queries.

        The weights come from the points near each query, without a kernel for the values. `kernel` and
        `alpha` are those of the surface. Works for any number of points. Needs SciPy.
        `gramian.SurfaceOperatorFit` describes the options.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.

        Returns
        -------
        LaplaceBeltramiSparseMatrix
            `matrix`, a `scipy.sparse.csr_matrix` of shape `[m, n]`. Rows have no entries where there is no
            value, and `flags` says why.

        Raises
        ------
        ModuleNotFoundError
            If SciPy is not installed.

        Examples
        --------
        >>> angles = np.arange(100) * np.pi / 50
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> answer = circle.laplace_beltrami_sparse_matrix(solver="local")
        >>> answer.matrix.shape, (answer.matrix @ np.cos(angles)).round(2)[0]
        ((100, 100), np.float64(-1.0))
        """
        require_scipy()
        return self._compute(
            LaplaceBeltramiSparseMatrix.read, "/v1/laplace-beltrami/sparse-matrix", queries=queries, **options
        )
