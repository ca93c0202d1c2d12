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
    """The part of `Cloud` that concerns operators on the surface of its points; V is the unit of values."""

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
            At the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            On the surface, a row of coordinates each; the points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, where it comes from another cloud or fit than the values.
        include : str or several, optional
            What is wanted beside: `"deviations"`; nothing if absent.
        deviations : bool, optional
            Whether standard deviations are wanted, as by `include="deviations"`.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), its parameters (`gramian.Kernel("gauss", length_scale=2)` or as a dictionary), or the
            `diagnostics.kernel` of an answer. If absent, learned from the values by their likelihood, with its variance
            and the noise, chosen from the cloud for the surface, and repeated in `diagnostics`.
        alpha : float, optional
            Added to the diagonal of the Gram matrix, V²: 0 interpolates, the variance of the noise regresses. If
            absent, 1e-10 with a kernel given, else learned from the values. The same for the surface if given here;
            if absent, as for `Cloud.normals`.
        mean : str, optional
            What u is made of beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the coordinates. A constant if
            absent with `kernel`, else zero.
        noise_variances : array_like, `[n]`, optional
            The variance of the noise at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`, `"local"` for weights of the points near each query, which take no `kernel` or `alpha` and
            any number of points, or `"auto"` to let the service choose, as it does if absent.
        duplicates : str, optional
            What to do with points that coincide when `alpha` is 0: `"refuse"` them, as if absent, or `"merge"` them.

        Returns
        -------
        SurfaceGradient
            `gradients` at the queries, NaN where there is none; `degenerate` says why.

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
            On the surface, a row of coordinates each; the points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, where it comes from another cloud or fit than the values.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), its parameters (`gramian.Kernel("gauss", length_scale=2)` or as a dictionary), or the
            `diagnostics.kernel` of an answer. Chosen from the cloud if absent, and repeated in `diagnostics`.
        alpha : float, optional
            Added to the diagonal of the Gram matrix, V²: 0 interpolates, the variance of the noise regresses; 1e-10 for
            the values if absent. For the surface it is the same if given here; if absent, as for `Cloud.normals`.
        mean : str, optional
            That of the functions through the values: `"zero"` if absent, `"constant"`, or `"linear"` in the
            coordinates. With a constant the matrix makes constants exactly 0.
        noise_variances : array_like, `[n]`, optional
            The variance of the noise at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`, or `"auto"` to let the service choose, as it does if absent.
        duplicates : str, optional
            What to do with points that coincide when `alpha` is 0: `"refuse"` them, as if absent, or `"merge"` them.

        Returns
        -------
        SurfaceGradientMatrix
            `matrices`, `[d, m, n]`, whose rows are NaN where there is no gradient; `degenerate` says why.

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
        """Assembles sparse matrices, one per coordinate, that turn values at the points into surface gradients.

        From the points near each query, with no kernel for the values: `kernel` and `alpha` are those of the surface.
        Takes any number of points, and SciPy.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            On the surface, a row of coordinates each; the points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, where its points are those of another cloud.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), its parameters (`gramian.Kernel("gauss", length_scale=2)` or as a dictionary), or the
            `diagnostics.kernel` of an answer. Chosen from the cloud if absent, and repeated in `diagnostics`.
        alpha : float, optional
            Added to the diagonal of the Gram matrix of the surface, as for `Cloud.normals`.
        noise_variances : array_like, `[n]`, optional
            The variance of the noise at each point, instead of `alpha`.
        solver : str, optional
            How the surface is fitted: `"dense"`, `"local"` for regressions of the points near each query, or `"auto"`
            to let the service choose, as it does if absent.
        duplicates : str, optional
            What to do with points that coincide when `alpha` is 0: `"refuse"` them, as if absent, or `"merge"` them.
        sites : array_like, `[s, d]`, optional
            Where the local solver learns noise and shape of the surface, at most 192 points of the cloud; some that
            it chooses if absent.

        Returns
        -------
        SurfaceGradientSparseMatrix
            `matrices`, d of `scipy.sparse.csr_matrix` with the shape `[m, n]`, whose rows have no entries where there
            is no gradient; `degenerate` says why.

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
        """Applies the Laplace–Beltrami operator to the function through values: on the unit circle Δ cos θ = −cos θ.

        Parameters
        ----------
        values : array_like, `[n]`
            At the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            On the surface, a row of coordinates each; the points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, where it comes from another cloud or fit than the values.
        include : str or several, optional
            What is wanted beside: `"deviations"`; nothing if absent.
        deviations : bool, optional
            Whether standard deviations are wanted, as by `include="deviations"`.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), its parameters (`gramian.Kernel("gauss", length_scale=2)` or as a dictionary), or the
            `diagnostics.kernel` of an answer. If absent, learned from the values by their likelihood, with its variance
            and the noise, chosen from the cloud for the surface, and repeated in `diagnostics`.
        alpha : float, optional
            Added to the diagonal of the Gram matrix, V²: 0 interpolates, the variance of the noise regresses. If
            absent, 1e-10 with a kernel given, else learned from the values. The same for the surface if given here;
            if absent, as for `Cloud.normals`.
        mean : str, optional
            What u is made of beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the coordinates. A constant if
            absent with `kernel`, else zero.
        noise_variances : array_like, `[n]`, optional
            The variance of the noise at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`, `"local"` for weights of the points near each query, which take no `kernel` or `alpha` and
            any number of points, or `"auto"` to let the service choose, as it does if absent.
        duplicates : str, optional
            What to do with points that coincide when `alpha` is 0: `"refuse"` them, as if absent, or `"merge"` them.

        Returns
        -------
        LaplaceBeltrami
            `values` of Δu at the queries, NaN where there is none; `degenerate` says why.

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
            On the surface, a row of coordinates each; the points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, where it comes from another cloud or fit than the values.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), its parameters (`gramian.Kernel("gauss", length_scale=2)` or as a dictionary), or the
            `diagnostics.kernel` of an answer. Chosen from the cloud if absent, and repeated in `diagnostics`.
        alpha : float, optional
            Added to the diagonal of the Gram matrix, V²: 0 interpolates, the variance of the noise regresses; 1e-10 for
            the values if absent. For the surface it is the same if given here; if absent, as for `Cloud.normals`.
        mean : str, optional
            That of the functions through the values: `"zero"` if absent, `"constant"`, or `"linear"` in the
            coordinates. With a constant the matrix makes constants exactly 0.
        noise_variances : array_like, `[n]`, optional
            The variance of the noise at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`, or `"auto"` to let the service choose, as it does if absent.
        duplicates : str, optional
            What to do with points that coincide when `alpha` is 0: `"refuse"` them, as if absent, or `"merge"` them.

        Returns
        -------
        LaplaceBeltramiMatrix
            `matrix`, `[m, n]`, whose rows are NaN where there is no value; `degenerate` says why.

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

        From the points near each query, with no kernel for the values: `kernel` and `alpha` are those of the surface.
        Takes any number of points, and SciPy.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            On the surface, a row of coordinates each; the points of the surface's cloud if absent.
        geometry : Geometry, dict, Cloud or Diagnostics, optional
            The surface, where its points are those of another cloud.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), its parameters (`gramian.Kernel("gauss", length_scale=2)` or as a dictionary), or the
            `diagnostics.kernel` of an answer. Chosen from the cloud if absent, and repeated in `diagnostics`.
        alpha : float, optional
            Added to the diagonal of the Gram matrix of the surface, as for `Cloud.normals`.
        noise_variances : array_like, `[n]`, optional
            The variance of the noise at each point, instead of `alpha`.
        solver : str, optional
            How the surface is fitted: `"dense"`, `"local"` for regressions of the points near each query, or `"auto"`
            to let the service choose, as it does if absent.
        duplicates : str, optional
            What to do with points that coincide when `alpha` is 0: `"refuse"` them, as if absent, or `"merge"` them.
        sites : array_like, `[s, d]`, optional
            Where the local solver learns noise and shape of the surface, at most 192 points of the cloud; some that
            it chooses if absent.

        Returns
        -------
        LaplaceBeltramiSparseMatrix
            `matrix`, a `scipy.sparse.csr_matrix` with the shape `[m, n]`, whose rows have no entries where there is no
            value; `degenerate` says why.

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
