"""Operators on the surface that the points of a cloud sample, applied to values or as matrices."""

from __future__ import annotations

from collections.abc import Iterable

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
from ..arguments.fit import Deviations, Duplicates, GeometryLike, KernelLike, Mean, Number, Solver
from ..arguments.keywords import suggest_names
from ..arguments.normalise import GEOMETRIC, with_deviations
from ..arguments.registration import RegisteredCloud


@suggest_names
class OperatorsOnCloud(RegisteredCloud):
    """The part of `Cloud` that concerns operators on the surface of its points. V is the unit of values."""

    def surface_gradient(
        self,
        values: npt.ArrayLike,
        queries: npt.ArrayLike | None = None,
        *,
        geometry: GeometryLike | None = None,
        include: Deviations | Iterable[Deviations] | None = None,
        deviations: bool | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        mean: Mean | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
    ) -> SurfaceGradient:
        """Computes the tangential part ∇u − (∇u·ν)ν of the gradient of the function through values.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, if it has another cloud or fit than the values.
        include : str or several, optional
            Additional results: `"deviations"`. Nothing if absent.
        deviations : bool, optional
            True for standard deviations, as by `include="deviations"`.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. If absent, learned from the values by their
            likelihood, with its variance and the noise, and chosen from the cloud for the surface.
            `diagnostics` reports it.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses.
            If absent, 1e-10 where `kernel` is given, else learned from the values. If given, it applies to
            the surface too. If absent, the surface has the default of `Cloud.normals`.
        mean : str, optional
            Mean of u, beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the coordinates. If absent,
            a constant where `kernel` is absent too, else zero.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`; `"local"` for weights of the points near each query, without `kernel` or `alpha` and
            for any number of points; or `"auto"` (if absent) to let the service choose.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.

        Returns
        -------
        SurfaceGradient
            `gradients` at the queries, NaN where there is none. `degenerate` says why.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> circle.surface_gradient(np.cos(angles), [[0.8, 0.6]], kernel=kernel).gradients.round(3)
        array([[ 0.36, -0.48]])
        """
        return self._compute(
            SurfaceGradient.read,
            "/v1/surface-gradient",
            GEOMETRIC,
            values=values,
            queries=queries,
            geometry=geometry,
            include=with_deviations(include, deviations),
            kernel=kernel,
            alpha=alpha,
            mean=mean,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
        )

    def surface_gradient_matrix(
        self,
        queries: npt.ArrayLike | None = None,
        *,
        geometry: GeometryLike | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        mean: Mean | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
    ) -> SurfaceGradientMatrix:
        """Assembles the matrices, one per coordinate, that turn values at the points into surface gradients.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, if it has another cloud or fit than the values.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. Chosen from the cloud if absent, and
            reported in `diagnostics`.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses.
            1e-10 for the values if absent. If given, it applies to the surface too. If absent, the surface
            has the default of `Cloud.normals`.
        mean : str, optional
            Mean of the functions through the values: `"zero"` (if absent), `"constant"`, or `"linear"` in the
            coordinates. With a constant the matrix maps constants exactly to 0.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`, or `"auto"` (if absent) to let the service choose.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.

        Returns
        -------
        SurfaceGradientMatrix
            `matrices`, `[d, m, n]`. Rows are NaN where there is no gradient, and `degenerate` says why.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> answer = circle.surface_gradient_matrix([[0.8, 0.6]], kernel=kernel)
        >>> answer.matrices.shape, (answer.matrices @ np.cos(angles)).round(3).T
        ((2, 1, 8), array([[ 0.36, -0.48]]))
        """
        return self._compute(
            SurfaceGradientMatrix.read,
            "/v1/surface-gradient/matrix",
            queries=queries,
            geometry=geometry,
            kernel=kernel,
            alpha=alpha,
            mean=mean,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
        )

    def surface_gradient_sparse_matrix(
        self,
        queries: npt.ArrayLike | None = None,
        *,
        geometry: GeometryLike | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
        sites: npt.ArrayLike | None = None,
    ) -> SurfaceGradientSparseMatrix:
        """Assembles sparse matrices, one per coordinate, that map values to surface gradients.

        The weights come from the points near each query, without a kernel for the values. `kernel` and
        `alpha` are those of the surface. Works for any number of points. Needs SciPy.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, if it is sampled by the points of another cloud.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. Chosen from the cloud if absent, and
            reported in `diagnostics`.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix of the surface, as for `Cloud.normals`.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, instead of `alpha`.
        solver : str, optional
            Solver for the fit of the surface: `"dense"`, `"local"` for regressions of the points near each
            query, or `"auto"` (if absent) to let the service choose.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.
        sites : array_like, `[s, d]`, optional
            Positions at which the local solver learns noise and shape of the surface, at most 192 points of
            the cloud. The solver chooses some if absent.

        Returns
        -------
        SurfaceGradientSparseMatrix
            `matrices`, d matrices of type `scipy.sparse.csr_matrix` and shape `[m, n]`. Rows have no entries
            where there is no gradient, and `degenerate` says why.

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
            SurfaceGradientSparseMatrix.read,
            "/v1/surface-gradient/sparse-matrix",
            queries=queries,
            geometry=geometry,
            kernel=kernel,
            alpha=alpha,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
            sites=sites,
        )

    def laplace_beltrami(
        self,
        values: npt.ArrayLike,
        queries: npt.ArrayLike | None = None,
        *,
        geometry: GeometryLike | None = None,
        include: Deviations | Iterable[Deviations] | None = None,
        deviations: bool | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        mean: Mean | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
    ) -> LaplaceBeltrami:
        """Applies the Laplace–Beltrami operator to the function through values.

        On the unit circle Δ cos θ = −cos θ.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, if it has another cloud or fit than the values.
        include : str or several, optional
            Additional results: `"deviations"`. Nothing if absent.
        deviations : bool, optional
            True for standard deviations, as by `include="deviations"`.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. If absent, learned from the values by their
            likelihood, with its variance and the noise, and chosen from the cloud for the surface.
            `diagnostics` reports it.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses.
            If absent, 1e-10 where `kernel` is given, else learned from the values. If given, it applies to
            the surface too. If absent, the surface has the default of `Cloud.normals`.
        mean : str, optional
            Mean of u, beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the coordinates. If absent,
            a constant where `kernel` is absent too, else zero.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`; `"local"` for weights of the points near each query, without `kernel` or `alpha` and
            for any number of points; or `"auto"` (if absent) to let the service choose.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.

        Returns
        -------
        LaplaceBeltrami
            `values` of Δu at the queries, NaN where there is none. `degenerate` says why.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> circle.laplace_beltrami(np.cos(angles), [[0.8, 0.6]], kernel=kernel).values.round(3)
        array([-0.8])
        """
        return self._compute(
            LaplaceBeltrami.read,
            "/v1/laplace-beltrami",
            GEOMETRIC,
            values=values,
            queries=queries,
            geometry=geometry,
            include=with_deviations(include, deviations),
            kernel=kernel,
            alpha=alpha,
            mean=mean,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
        )

    def laplace_beltrami_matrix(
        self,
        queries: npt.ArrayLike | None = None,
        *,
        geometry: GeometryLike | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        mean: Mean | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
    ) -> LaplaceBeltramiMatrix:
        """Assembles the matrix that turns values at the points into Δu at the queries.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, if it has another cloud or fit than the values.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. Chosen from the cloud if absent, and
            reported in `diagnostics`.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses.
            1e-10 for the values if absent. If given, it applies to the surface too. If absent, the surface
            has the default of `Cloud.normals`.
        mean : str, optional
            Mean of the functions through the values: `"zero"` (if absent), `"constant"`, or `"linear"` in the
            coordinates. With a constant the matrix maps constants exactly to 0.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`, or `"auto"` (if absent) to let the service choose.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.

        Returns
        -------
        LaplaceBeltramiMatrix
            `matrix`, `[m, n]`. Rows are NaN where there is no value, and `degenerate` says why.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> answer = circle.laplace_beltrami_matrix(kernel=kernel)
        >>> answer.matrix.shape, (answer.matrix @ np.cos(angles)).round(3)[0]
        ((8, 8), np.float64(-1.0))
        """
        return self._compute(
            LaplaceBeltramiMatrix.read,
            "/v1/laplace-beltrami/matrix",
            queries=queries,
            geometry=geometry,
            kernel=kernel,
            alpha=alpha,
            mean=mean,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
        )

    def laplace_beltrami_sparse_matrix(
        self,
        queries: npt.ArrayLike | None = None,
        *,
        geometry: GeometryLike | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
        sites: npt.ArrayLike | None = None,
    ) -> LaplaceBeltramiSparseMatrix:
        """Assembles the sparse matrix that turns values at the points into Δu at the queries.

        The weights come from the points near each query, without a kernel for the values. `kernel` and
        `alpha` are those of the surface. Works for any number of points. Needs SciPy.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions on the surface, a row of coordinates each. The points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, if it is sampled by the points of another cloud.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. Chosen from the cloud if absent, and
            reported in `diagnostics`.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix of the surface, as for `Cloud.normals`.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, instead of `alpha`.
        solver : str, optional
            Solver for the fit of the surface: `"dense"`, `"local"` for regressions of the points near each
            query, or `"auto"` (if absent) to let the service choose.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.
        sites : array_like, `[s, d]`, optional
            Positions at which the local solver learns noise and shape of the surface, at most 192 points of
            the cloud. The solver chooses some if absent.

        Returns
        -------
        LaplaceBeltramiSparseMatrix
            `matrix`, a `scipy.sparse.csr_matrix` of shape `[m, n]`. Rows have no entries where there is no
            value, and `degenerate` says why.

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
            LaplaceBeltramiSparseMatrix.read,
            "/v1/laplace-beltrami/sparse-matrix",
            queries=queries,
            geometry=geometry,
            kernel=kernel,
            alpha=alpha,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
            sites=sites,
        )
