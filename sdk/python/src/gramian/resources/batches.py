"""Operations on many lists of values at the points of a cloud."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy.typing as npt

from ..answers import InterpolationBatch, PosteriorBatch
from ..arguments.fit import Deviations, Duplicates, KernelLike, Mean, Number, Quantity, Solver, Whole
from ..arguments.keywords import suggest_names
from ..arguments.normalise import BATCH, GEOMETRIC_BATCH, with_deviations
from ..arguments.registration import RegisteredCloud


@suggest_names
class BatchesOnCloud(RegisteredCloud):
    """The part of `Cloud` that concerns many lists of values at its points. V is their unit."""

    def interpolate_batch(
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
    ) -> InterpolationBatch:
        """Fits a function to each of k lists of values, with one factorization for all, and evaluates them.

        Each function is the one that `interpolate` fits to its list with the same kernel and noise.

        Parameters
        ----------
        values : array_like, `[k, n]`
            A row for each list, with a value at each point, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions at which to evaluate the functions, a row of coordinates each. The points if absent.
        derivatives : 0, 1 or 2, optional
            1 for gradients, 2 for Hessians as well. 0 if absent.
        include : str or several, optional
            Additional results: `"deviations"`. Nothing if absent.
        deviations : bool, optional
            True for standard deviations, as by `include="deviations"`.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. If absent, learned from all lists together
            by their likelihood, with its variance and the noise, and reported in `diagnostics`.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses.
            If absent, 1e-10 where `kernel` is given, else learned from the values.
        mean : str, optional
            Mean of each function, beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the
            coordinates. If absent, a constant where `kernel` is absent too, else zero.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"` or `"auto"`, which mean the same here. `"auto"` if absent.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.

        Returns
        -------
        InterpolationBatch
            `values` at the queries, a row for each list, and `gradients`, `hessians` and deviations if
            requested.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> kernel = gramian.Kernel("gauss", length_scale=2)
        >>> answer = circle.interpolate_batch([np.cos(angles), np.sin(angles)], [[0.8, 0.6]], kernel=kernel)
        >>> answer.values.round(2)
        array([[0.8],
               [0.6]])
        """
        return self._compute(
            InterpolationBatch.read,
            "/v1/interpolation/batch",
            GEOMETRIC_BATCH,
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

    def posterior_batch(
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
    ) -> PosteriorBatch:
        """Computes the posteriors of k Gaussian processes with one kernel, noise and factorization.

        Each posterior is the one that `posterior` computes from its list of values. Variances and covariances
        do not depend on values, so all lists share them.

        Parameters
        ----------
        values : array_like, `[k, n]`
            A row for each list, with a value at each point, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions at which to evaluate the posteriors, a row of coordinates each. The points if absent.
        include : str or several, optional
            Additional results beside the means: `"variance"`, `"observation_variance"`, `"covariance"`,
            `"gradients"`, `"gradient_variances"`, `"log_marginal_likelihood"`. Nothing if absent.
        samples : int or dict, optional
            Number of functions to draw from each posterior, jointly at all queries, or
            `{"count": 10, "seed": 1}`.
        quantiles : array_like, `[q]`, optional
            Probabilities between 0 and 1 for which to return quantiles of the latent functions.
        threshold : float, optional
            Threshold of `exceedance_probabilities`, V: the probabilities that a new observation exceeds it.
        kernel : str, dict or Kernel, optional
            A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
            dictionary), or the `diagnostics.kernel` of an answer. If absent, learned from all lists together
            by their likelihood, with its variance and the noise, and reported in `diagnostics`.
        alpha : float, optional
            Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses.
            If absent, 1e-10 where `kernel` is given, else learned from the values.
        mean : str, optional
            Mean of each function, beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the
            coordinates. If absent, a constant where `kernel` is absent too, else zero.
        noise_variances : array_like, `[n]`, optional
            The noise variance at each point, V², instead of `alpha`.
        solver : str, optional
            `"dense"` or `"auto"`, which mean the same here. `"auto"` if absent.
        duplicates : str, optional
            Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.

        Returns
        -------
        PosteriorBatch
            `means` at the queries, a row for each list, and the results named by `include`.

        Examples
        --------
        >>> line = gramian.Client().cloud([[0], [1], [2], [3]])
        >>> kernel = gramian.Kernel("gauss", length_scale=1)
        >>> lists = [[0, 1, 0, 1], [4, 3, 2, 1]]
        >>> answer = line.posterior_batch(lists, [[1], [9]], include="variance", kernel=kernel, alpha=0.01)
        >>> answer.means.round(2) + 0.0, answer.variances.round(2)
        (array([[0.98, 0.  ],
               [2.99, 0.  ]]), array([0.01, 1.  ]))
        """
        return self._compute(
            PosteriorBatch.read,
            "/v1/posterior/batch",
            BATCH,
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
