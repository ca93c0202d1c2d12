"""Operations on many lists of values at the points of a cloud."""

from __future__ import annotations

from typing import Unpack

import numpy.typing as npt

from ..answers import InterpolationBatch, PosteriorBatch
from ..arguments.keywords import suggest_names
from ..arguments.normalise import BATCH, GEOMETRIC_BATCH
from ..arguments.options import InterpolationOptions, PosteriorOptions
from ..arguments.registration import RegisteredCloud


@suggest_names
class BatchesOnCloud(RegisteredCloud):
    """The part of `Cloud` that concerns many lists of values at its points. V is their unit."""

    def interpolate_batch(
        self, values: npt.ArrayLike, queries: npt.ArrayLike | None = None, **options: Unpack[InterpolationOptions]
    ) -> InterpolationBatch:
        """Fits a function to each of k lists of values, with one factorization for all, and evaluates them.

        Each function is the one that `interpolate` fits to its list with the same kernel and noise. An absent
        kernel is learned from all lists together. The solver is dense. `gramian.InterpolationOptions`
        describes the options.

        Parameters
        ----------
        values : array_like, `[k, n]`
            A row for each list, with a value at each point, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions at which to evaluate the functions, a row of coordinates each. The points if absent.

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
            **options,
        )

    def posterior_batch(
        self, values: npt.ArrayLike, queries: npt.ArrayLike | None = None, **options: Unpack[PosteriorOptions]
    ) -> PosteriorBatch:
        """Computes the posteriors of k Gaussian processes with one kernel, noise and factorization.

        Each posterior is the one that `posterior` computes from its list of values. Variances and covariances
        do not depend on values, so all lists share them. An absent kernel is learned from all lists together.
        The solver is dense. `gramian.PosteriorOptions` describes the options.

        Parameters
        ----------
        values : array_like, `[k, n]`
            A row for each list, with a value at each point, in their order, unit V.
        queries : array_like, `[m, d]`, optional
            Positions at which to evaluate the posteriors, a row of coordinates each. The points if absent.

        Returns
        -------
        PosteriorBatch
            `means` at the queries, a row for each list, and the results named by `include`.

        Examples
        --------
        >>> line = gramian.Client().cloud([[0], [1], [2], [3]])
        >>> kernel = gramian.Kernel("gauss", length_scale=1)
        >>> lists = [[0, 1, 0, 1], [4, 3, 2, 1]]
        >>> answer = line.posterior_batch(lists, [[1], [9]], include="variances", kernel=kernel, alpha=0.01)
        >>> answer.means.round(2) + 0.0, answer.variances.round(2)
        (array([[0.98, 0.  ],
               [2.99, 0.  ]]), array([0.01, 1.  ]))
        """
        return self._compute(
            PosteriorBatch.read, "/v1/posterior/batch", BATCH, values=values, queries=queries, **options
        )
