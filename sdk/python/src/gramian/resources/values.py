"""Operations on values at the points of a cloud."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy.typing as npt

from ..answers import Interpolation, Posterior
from ..arguments.fit import Deviations, Duplicates, KernelLike, Mean, Number, Quantity, Solver, Whole
from ..arguments.keywords import suggest_names
from ..arguments.normalise import GEOMETRIC, with_deviations
from ..arguments.registration import RegisteredCloud


@suggest_names
class ValuesOfCloud(RegisteredCloud):
    """The part of `Cloud` that concerns values at its points. V is their unit."""

    def interpolate(
        self,
        values: npt.ArrayLike,
        queries: npt.ArrayLike | None = None,
        *,
        derivatives: Whole | None = None,
        include: Deviations | Iterable[Deviations] | None = None,
        deviations: bool | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        mean: Mean | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
    ) -> Interpolation:
        """Fits `u = Σ λ_j k(·, x_j)` to values, (K + αI)Λ = Y, and evaluates it.

        With `alpha=0` u equals the values at the points exactly.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions at which to evaluate u, a row of coordinates each. The points if absent.
        derivatives : 0, 1 or 2, optional
            1 for gradients, 2 for Hessians as well. 0 if absent.
        include : str or several, optional
            Additional results: `"deviations"`. Nothing if absent.
        deviations : bool, optional
            True for standard deviations, as by `include="deviations"`.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. If absent, learned from the values by their
            likelihood, with its variance and the noise, and reported in `diagnostics`.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses.
            If absent, 1e-10 where `kernel` is given, else learned from the values.
        mean : str, optional
            Mean of u, beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the coordinates. If absent,
            a constant where `kernel` is absent too, else zero.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`; `"local"` to solve for each query with the points nearest to it; or `"auto"` (if
            absent) to let the service choose.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.

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
            Interpolation.read,
            "/v1/interpolation",
            GEOMETRIC,
            values=values,
            queries=queries,
            derivatives=derivatives,
            include=with_deviations(include, deviations),
            kernel=kernel,
            alpha=alpha,
            mean=mean,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
        )

    def posterior(
        self,
        values: npt.ArrayLike,
        queries: npt.ArrayLike | None = None,
        *,
        include: Quantity | Iterable[Quantity] | None = None,
        samples: Whole | Mapping[str, Whole] | None = None,
        quantiles: npt.ArrayLike | None = None,
        threshold: Number | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        mean: Mean | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
    ) -> Posterior:
        """Computes the posterior of a Gaussian process: covariance by the kernel, noise of variance `alpha`.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions at which to evaluate the posterior, a row of coordinates each. The points if absent.
        include : str or several, optional
            Additional results beside the mean: `"variance"`, `"observation_variance"`, `"covariance"`,
            `"gradients"`, `"gradient_variances"`, `"log_marginal_likelihood"`. Nothing if absent.
        samples : int or dict, optional
            Number of functions to draw from the posterior, jointly at all queries, or
            `{"count": 10, "seed": 1}`.
        quantiles : array_like, `[q]`, optional
            Probabilities between 0 and 1 for which to return quantiles of the latent function.
        threshold : float, optional
            Threshold of `exceedance_probabilities`, V: the probabilities that a new observation exceeds it.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. If absent, learned from the values by their
            likelihood, with its variance and the noise, and reported in `diagnostics`.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses.
            If absent, 1e-10 where `kernel` is given, else learned from the values.
        mean : str, optional
            Mean of u, beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the coordinates. If absent,
            a constant where `kernel` is absent too, else zero.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"`; `"local"` to solve for each query with the points nearest to it; or `"auto"` (if
            absent) to let the service choose.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.

        Returns
        -------
        Posterior
            `means` at the queries, and the results named by `include`.

        Examples
        --------
        >>> line = gramian.Client().cloud([[0], [1], [2], [3]])
        >>> kernel = gramian.Kernel("gauss", length_scale=1)
        >>> answer = line.posterior([0, 1, 0, 1], [[1], [9]], include="variance", kernel=kernel, alpha=0.01)
        >>> answer.means.round(2) + 0.0, answer.variances.round(2)
        (array([0.98, 0.  ]), array([0.01, 1.  ]))
        >>> answer = line.posterior([0, 1, 0, 1], [[1]], kernel=kernel, alpha=0.01, samples=3, quantiles=[0.05, 0.95])
        >>> answer.samples.shape, answer.quantiles.round(2)
        ((3, 1), array([[0.82],
               [1.15]]))
        """
        return self._compute(
            Posterior.read,
            "/v1/posterior",
            values=values,
            queries=queries,
            include=include,
            samples=samples,
            quantiles=quantiles,
            threshold=threshold,
            kernel=kernel,
            alpha=alpha,
            mean=mean,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
        )
