"""Functions through values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from ..arguments.fit import ValuesFit, values_fit_used
from ..rest.models import Diagnostics
from ..wire.tensors import Array, Members
from .answer import Answer


@dataclass(frozen=True, eq=False, repr=False)
class Interpolation(Answer):
    """A function u through the values (close to them, if `alpha` > 0), at the queries.

    Attributes
    ----------
    values
        `[m]`, V. u at each query.
    gradients
        `[m, d]`, V/L. ∇u, with `derivatives` of 1 or 2.
    hessians
        `[m, d, d]`, V/L². D²u, with `derivatives` of 2.
    value_deviations, gradient_deviations, hessian_deviations
        Standard deviations of `values`, `gradients` and `hessians` given the data, of the same shapes, with
        `deviations`.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    values: Array
    gradients: Array | None
    hessians: Array | None
    value_deviations: Array | None
    gradient_deviations: Array | None
    hessian_deviations: Array | None
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/interpolation`."""
        d = members.diagnostics.dimension
        return cls(
            values=members.array("values"),
            gradients=members.optional("gradients", d),
            hessians=members.optional("hessians", d, d),
            value_deviations=members.optional("value_deviations"),
            gradient_deviations=members.optional("gradient_deviations", d),
            hessian_deviations=members.optional("hessian_deviations", d, d),
            diagnostics=members.diagnostics,
            fit=values_fit_used(members.diagnostics, members.request),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Posterior(Answer):
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
    variances: Array | None
    observation_variances: Array | None
    covariance: Array | None
    gradients: Array | None
    gradient_variances: Array | None
    samples: Array | None
    quantiles: Array | None
    exceedance_probabilities: Array | None
    log_marginal_likelihood: float | None
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/posterior`."""
        diagnostics = members.diagnostics
        return cls(
            means=members.array("means"),
            variances=members.optional("variances"),
            observation_variances=members.optional("observation_variances"),
            covariance=members.optional("covariance", diagnostics.n_queries),
            gradients=members.optional("gradients", diagnostics.dimension),
            gradient_variances=members.optional("gradient_variances", diagnostics.dimension),
            samples=members.optional("samples", diagnostics.n_queries),
            quantiles=members.optional("quantiles", diagnostics.n_queries),
            exceedance_probabilities=members.optional("exceedance_probabilities"),
            log_marginal_likelihood=members.fields.get("log_marginal_likelihood"),
            diagnostics=diagnostics,
            fit=values_fit_used(diagnostics, members.request),
        )
