"""Operations on values at the points of a cloud."""

from __future__ import annotations

from typing import Unpack

import numpy.typing as npt

from ..answers import Interpolation, Posterior
from ..arguments.keywords import suggest_names
from ..arguments.normalise import GEOMETRIC
from ..arguments.options import InterpolationOptions, PosteriorOptions
from ..arguments.registration import RegisteredCloud


@suggest_names
class ValuesOfCloud(RegisteredCloud):
    """The part of `Cloud` that concerns values at its points. V is their unit."""

    def interpolate(
        self, values: npt.ArrayLike, queries: npt.ArrayLike | None = None, **options: Unpack[InterpolationOptions]
    ) -> Interpolation:
        """Fits `u = Σ λ_j k(·, x_j)` to values, (K + αI)Λ = Y, and evaluates it.

        With `alpha=0` u equals the values at the points exactly. `gramian.InterpolationOptions` describes the
        options.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions at which to evaluate u, a row of coordinates each. The points if absent.

        Returns
        -------
        Interpolation
            `values` of u at the queries, and `gradients`, `hessians` and deviations if requested.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> answer = circle.interpolate(np.cos(angles), [[0.8, 0.6]], derivatives=1)
        >>> answer.values.round(3), answer.gradients.shape
        (array([0.8]), (1, 2))
        >>> again = circle.interpolate(np.cos(angles), [[0.8, 0.6]], **answer.fit)  # with the kernel chosen
        >>> np.array_equal(again.values, answer.values)
        True
        """
        return self._compute(
            Interpolation.read, "/v1/interpolation", GEOMETRIC, values=values, queries=queries, **options
        )

    def posterior(
        self, values: npt.ArrayLike, queries: npt.ArrayLike | None = None, **options: Unpack[PosteriorOptions]
    ) -> Posterior:
        """Computes the posterior of a Gaussian process: covariance by the kernel, noise of variance `alpha`.

        `gramian.PosteriorOptions` describes the options.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions at which to evaluate the posterior, a row of coordinates each. The points if absent.

        Returns
        -------
        Posterior
            `means` at the queries, and the results named by `include`.

        Examples
        --------
        >>> line = gramian.Client().cloud([[0], [1], [2], [3]])
        >>> kernel = gramian.Kernel("gauss", length_scale=1)
        >>> answer = line.posterior([0, 1, 0, 1], [[1], [9]], include="variances", kernel=kernel, alpha=0.01)
        >>> answer.means.round(2) + 0.0, answer.variances.round(2)
        (array([0.98, 0.  ]), array([0.01, 1.  ]))
        >>> answer = line.posterior([0, 1, 0, 1], [[1]], kernel=kernel, alpha=0.01, samples=3, quantiles=[0.05, 0.95])
        >>> answer.samples.shape, answer.quantiles.round(2)
        ((3, 1), array([[0.82],
               [1.15]]))
        """
        return self._compute(Posterior.read, "/v1/posterior", values=values, queries=queries, **options)
