"""Clouds and what can be asked about them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, Unpack

import numpy.typing as npt

from .answers import (
    Curvatures,
    Interpolation,
    LaplaceBeltrami,
    LaplaceBeltramiMatrix,
    Normals,
    Posterior,
    SurfaceGradient,
    SurfaceGradientMatrix,
)
from .fit import Fit, Geometry, Orientation, Quantity, Surface, as_list, as_rows, fit_fields, given
from .registration import RegisteredCloud
from .tensors import Members


class Cloud(RegisteredCloud):
    """Points that the service keeps under an id, and what can be asked about them.

    The id is a hash of the points (and normals, if given), so it is the same whenever and wherever they are posted. The
    service forgets the clouds that were not used for longest. A cloud that was made from points has a copy of them, and
    posts them again when an operation finds them forgotten; one that was listed by `Client.clouds()` has none, and
    raises `UnknownCloud` instead.

    A cloud does not change, and may be used by several threads. It belongs to its client and cannot be pickled; its
    points and its answers can.
    """

    def interpolate(
        self,
        values: npt.ArrayLike,
        queries: npt.ArrayLike | None = None,
        *,
        derivatives: Literal[0, 1, 2] = 0,
        **fit: Unpack[Fit],
    ) -> Interpolation:
        """Fits `u = Σ λ_j k(·, x_j)` to values, (K + αI)Λ = Y, and evaluates it.

        At `alpha=0` it takes the values at the points exactly.

        Args:
            values: `[n]`, at the points.
            queries: `[m, d]`, where u is wanted; the points if absent.
            derivatives: 1 for gradients, 2 for Hessians as well.
            fit: See `Fit`.

        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> answer = circle.interpolate(np.cos(angles), [[0.8, 0.6]], derivatives=1)
        >>> answer.values.round(3), answer.gradients.shape
        (array([0.8]), (1, 2))
        """
        request = self._request(queries, fit, values=as_list("values", values), derivatives=derivatives)
        return Interpolation.read(self._compute("/v1/interpolation", request))

    def posterior(
        self,
        values: npt.ArrayLike,
        queries: npt.ArrayLike | None = None,
        *,
        include: Iterable[Quantity] = (),
        **fit: Unpack[Fit],
    ) -> Posterior:
        """Computes the posterior of a Gaussian process with the kernel as covariance and noise of variance `alpha`.

        Args:
            values: `[n]`, observed at the points.
            queries: `[m, d]`, where the posterior is wanted; the points if absent.
            include: What is wanted beside the mean: `"variance"`, `"observation_variance"`, `"covariance"`,
                `"gradients"`, `"log_marginal_likelihood"`.
            fit: See `Fit`.

        >>> line = gramian.Client().cloud([[0], [1], [2], [3]])
        >>> kernel = gramian.Kernel(family=gramian.KernelFamily.GAUSS, length_scale=1.0)
        >>> answer = line.posterior([0, 1, 0, 1], [[1], [9]], kernel=kernel, alpha=0.01, include=["variance"])
        >>> answer.means.round(2) + 0.0, answer.variances.round(2)
        (array([0.98, 0.  ]), array([0.01, 1.  ]))
        """
        request = self._request(queries, fit, values=as_list("values", values), include=list(include) or None)
        return Posterior.read(self._compute("/v1/posterior", request))

    def normals(
        self,
        queries: npt.ArrayLike | None = None,
        *,
        surface: Surface | None = None,
        orientation: Orientation | None = None,
        **fit: Unpack[Fit],
    ) -> Normals:
        """Computes unit normals ν = −∇u/|∇u| of the surface that the points sample; no mesh is needed.

        Args:
            queries: `[m, d]`, where normals are wanted; the points if absent.
            surface: `"signature"` or `"offset"` to forbid the other function; `"auto"` if absent.
            orientation: `"outward"` if absent; `"gradient"` for the side that the gradient of u says.
            fit: See `Fit`.

        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel(family=gramian.KernelFamily.GAUSS, length_scale=2.0)
        >>> answer = circle.normals([[0.8, 0.6], [0, 0]], kernel=kernel)
        >>> answer.normals.round(3)
        array([[0.8, 0.6],
               [nan, nan]])
        >>> [(entry.query, entry.reason.value) for entry in answer.degenerate]
        [(1, 'vanishing_gradient')]
        """
        request = self._request(queries, fit, surface=surface, orientation=orientation)
        return Normals.read(self._compute("/v1/normals", request))

    def curvatures(
        self,
        queries: npt.ArrayLike | None = None,
        *,
        surface: Surface | None = None,
        orientation: Orientation | None = None,
        **fit: Unpack[Fit],
    ) -> Curvatures:
        """Computes principal, mean and Gaussian curvatures of the surface that the points sample; no mesh is needed.

        With outward normals a sphere of radius r has the curvatures +1/r.

        Args:
            queries: `[m, d]`, where curvatures are wanted; the points if absent.
            surface: `"signature"` or `"offset"` to forbid the other function; `"auto"` if absent.
            orientation: `"outward"` if absent; `"gradient"` for the side that the gradient of u says.
            fit: See `Fit`.

        >>> angles = np.arange(64) * np.pi / 32
        >>> circle = gramian.Client().cloud(5 * np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> circle.curvatures([[5, 0], [0, 5]]).principal_curvatures.round(2)
        array([[0.2],
               [0.2]])
        """
        request = self._request(queries, fit, surface=surface, orientation=orientation)
        return Curvatures.read(self._compute("/v1/curvatures", request))

    def surface_gradient(
        self,
        values: npt.ArrayLike,
        queries: npt.ArrayLike | None = None,
        *,
        geometry: Geometry | None = None,
        **fit: Unpack[Fit],
    ) -> SurfaceGradient:
        """Computes the tangential part ∇u − (∇u·ν)ν of the gradient of the function through values.

        Args:
            values: `[n]`, at the points.
            queries: `[m, d]`, on the surface; the points of the surface's cloud if absent.
            geometry: The surface, where it comes from another cloud or fit than the values.
            fit: See `Fit`.

        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel(family=gramian.KernelFamily.GAUSS, length_scale=2.0)
        >>> circle.surface_gradient(np.cos(angles), [[0.8, 0.6]], kernel=kernel).gradients.round(3)
        array([[ 0.36, -0.48]])
        """
        request = self._request(queries, fit, values=as_list("values", values))
        return SurfaceGradient.read(self._on_surface("/v1/surface-gradient", request, geometry))

    def surface_gradient_matrix(
        self, queries: npt.ArrayLike | None = None, *, geometry: Geometry | None = None, **fit: Unpack[Fit]
    ) -> SurfaceGradientMatrix:
        """Assembles the matrices, one per coordinate, that turn values at the points into surface gradients.

        Args:
            queries: `[m, d]`, on the surface; the points of the surface's cloud if absent.
            geometry: The surface, where it comes from another cloud or fit than the values.
            fit: See `Fit`.

        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel(family=gramian.KernelFamily.GAUSS, length_scale=2.0)
        >>> answer = circle.surface_gradient_matrix([[0.8, 0.6]], kernel=kernel)
        >>> answer.matrices.shape, (answer.matrices @ np.cos(angles)).round(3).T
        ((2, 1, 8), array([[ 0.36, -0.48]]))
        """
        request = self._request(queries, fit)
        return SurfaceGradientMatrix.read(self._on_surface("/v1/surface-gradient/matrix", request, geometry))

    def laplace_beltrami(
        self,
        values: npt.ArrayLike,
        queries: npt.ArrayLike | None = None,
        *,
        geometry: Geometry | None = None,
        **fit: Unpack[Fit],
    ) -> LaplaceBeltrami:
        """Applies the Laplace–Beltrami operator to the function through values: on the unit circle Δ cos θ = −cos θ.

        Args:
            values: `[n]`, at the points.
            queries: `[m, d]`, on the surface; the points of the surface's cloud if absent.
            geometry: The surface, where it comes from another cloud or fit than the values.
            fit: See `Fit`.

        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel(family=gramian.KernelFamily.GAUSS, length_scale=2.0)
        >>> circle.laplace_beltrami(np.cos(angles), [[0.8, 0.6]], kernel=kernel).values.round(3)
        array([-0.8])
        """
        request = self._request(queries, fit, values=as_list("values", values))
        return LaplaceBeltrami.read(self._on_surface("/v1/laplace-beltrami", request, geometry))

    def laplace_beltrami_matrix(
        self, queries: npt.ArrayLike | None = None, *, geometry: Geometry | None = None, **fit: Unpack[Fit]
    ) -> LaplaceBeltramiMatrix:
        """Assembles the matrix that turns values at the points into Δu at the queries.

        Args:
            queries: `[m, d]`, on the surface; the points of the surface's cloud if absent.
            geometry: The surface, where it comes from another cloud or fit than the values.
            fit: See `Fit`.

        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel(family=gramian.KernelFamily.GAUSS, length_scale=2.0)
        >>> answer = circle.laplace_beltrami_matrix(kernel=kernel)
        >>> answer.matrix.shape, (answer.matrix @ np.cos(angles)).round(3)[0]
        ((8, 8), np.float64(-1.0))
        """
        request = self._request(queries, fit)
        return LaplaceBeltramiMatrix.read(self._on_surface("/v1/laplace-beltrami/matrix", request, geometry))

    def _request(self, queries: npt.ArrayLike | None, fit: Fit, **fields: object) -> dict[str, object]:
        rows = None if queries is None else as_rows("queries", queries)
        return given(queries=rows, **fields, **fit_fields(fit))

    def _on_surface(self, path: str, request: dict[str, object], geometry: Geometry | None) -> Members:
        if geometry is None:
            return self._compute(path, request)
        return self._compute(path, {**request, "geometry": geometry.fields()}, geometry.cloud)
