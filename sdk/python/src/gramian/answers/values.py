"""Functions through values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

from ..arguments.fit import ValuesFit
from ..rest.models import Diagnostics
from ..wire.tensors import Array, Members
from .answer import Answer
from .fit import values_fit_used


class ValuesAnswer(Answer):
    """The base class of answers about functions through values."""

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer and the options of its fit."""
        return super().read(members, fit=values_fit_used(members), **derived)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Interpolation(ValuesAnswer):
    """A function u through the values (close to them, if `alpha` > 0), at the queries.

    Attributes
    ----------
    values
        `[m]`, V. u at each query.
    gradients
        `[m, d]`, V/L. ∇u, with `derivatives` of 1 or 2.
    hessians
        `[m, d, d]`, V/L². D²u, with `derivatives` of 2.
    value_std, gradient_std, hessian_std
        Standard deviations of `values`, `gradients` and `hessians` given the data, of the same shapes, with
        `std`.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    values: Array
    gradients: Array | None = None
    hessians: Array | None = None
    value_std: Array | None = None
    gradient_std: Array | None = None
    hessian_std: Array | None = None
    diagnostics: Diagnostics
    fit: ValuesFit


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Posterior(ValuesAnswer):
    """A Gaussian process given the values, at the queries. Quantities that were not requested are None.

    Attributes
    ----------
    means
        `[m]`, V. Posterior means.
    variances
        `[m]`, V². Variances of the latent function, without noise; ≥ 0.
    observation_variances
        `[m]`, V². Variances of a new, noisy observation.
    covariance
        `[m, m]`, V². Covariance of the latent function between queries.
    gradients
        `[m, d]`, V/L. Gradients of the mean.
    gradient_variances
        `[m, d]`, V²/L². Variances of the components of the latent function's gradient.
    samples
        `[count, m]`, V. Joint draws of the latent function.
    quantiles
        `[q, m]`, V. Quantiles of the latent function.
    exceedance_probabilities
        `[m]`. Probabilities that a new, noisy observation exceeds `threshold`.
    log_marginal_likelihood
        −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    means: Array
    variances: Array | None = None
    observation_variances: Array | None = None
    covariance: Array | None = None
    gradients: Array | None = None
    gradient_variances: Array | None = None
    samples: Array | None = None
    quantiles: Array | None = None
    exceedance_probabilities: Array | None = None
    log_marginal_likelihood: float | None = None
    diagnostics: Diagnostics
    fit: ValuesFit

    def plot(self, places: Array | None = None, ax: Any = None, **looks: Any) -> Any:  # noqa: ANN401 (PosteriorDisplay)
        """Draws the mean along a line, with a band in which the function is with 95 % if there are variances.

        Parameters
        ----------
        places : array_like, `[m]`, optional
            Where the queries are along the line. By the way from the first to each, if absent.
        ax : matplotlib.axes.Axes, optional
            Where to draw. New axes if absent.
        **looks
            Options of `gramian.plot.PosteriorDisplay.plot`.
        """
        from ..plot import PosteriorDisplay

        return PosteriorDisplay.from_answer(self, places).plot(ax, **looks)
