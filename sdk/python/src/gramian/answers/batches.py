"""Functions through many lists of values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..arguments.fit import ValuesFit
from ..rest.models import Diagnostics
from ..wire.tensors import Array
from .asked import asked
from .values import ValuesAnswer


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class InterpolationBatch(ValuesAnswer):
    """Functions through lists of values (close to them, if `alpha` > 0), at the queries.

    Deviations do not depend on the values, so they hold for each function.

    Attributes
    ----------
    values
        `[k, m]`, V. u of each list at each query.
    gradients
        `[k, m, d]`, V/L. ∇u of each list, with `derivatives` of 1 or 2.
    hessians
        `[k, m, d, d]`, V/L². D²u of each list, with `derivatives` of 2.
    value_std
        `[m]`, V. Standard deviation of any of the functions given its values, with `std`.
    gradient_std
        `[m, d]`, V/L. Standard deviations of the components of any ∇u.
    hessian_std
        `[m, d, d]`, V/L². Standard deviations of the entries of any D²u.
    mean_coefficients
        `[k, p]`. Mean of each list: the constant, V, then, if the mean is linear, a slope for each
        coordinate, V/L. None if the mean is zero.
    diagnostics
        The kernel and α used, how the system was solved, and how well. `relative_residual` is the largest of
        all lists.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    values: Array
    gradients: Array = asked("derivatives=1")
    hessians: Array = asked("derivatives=2")
    value_std: Array = asked("std=True")
    gradient_std: Array = asked("derivatives=1, std=True")
    hessian_std: Array = asked("derivatives=2, std=True")
    mean_coefficients: Array | None = None
    diagnostics: Diagnostics
    fit: ValuesFit

    SUMMARY: ClassVar = ("values", "gradients")


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PosteriorBatch(ValuesAnswer):
    """Gaussian processes given lists of values, at the queries.

    Quantities other than the means are present if the request asks for them.

    Quantities that depend on the values have a row for each list. The lists share all others.

    Attributes
    ----------
    means
        `[k, m]`, V. Posterior means.
    variances
        `[m]`, V². Variances of any of the latent functions, without noise; ≥ 0.
    observation_variances
        `[m]`, V². Variances of a new, noisy observation of any of them.
    covariance
        `[m, m]`, V². Covariance of any of the latent functions between queries.
    gradients
        `[k, m, d]`, V/L. Gradients of the means.
    gradient_variances
        `[m, d]`, V²/L². Variances of the components of any latent function's gradient.
    samples
        `[k, count, m]`, V. Joint draws of each latent function.
    quantiles
        `[k, q, m]`, V. Quantiles of each latent function.
    exceedance_probabilities
        `[k, m]`. Probabilities that a new, noisy observation exceeds `threshold`.
    log_marginal_likelihoods
        `[k]`. −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π for each list.
    mean_coefficients
        `[k, p]`. Mean of each list: the constant, V, then, if the mean is linear, a slope for each
        coordinate, V/L. None if the mean is zero.
    diagnostics
        The kernel and α used, how the system was solved, and how well. `relative_residual` is the largest of
        all lists.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    means: Array
    variances: Array = asked('include="variances"')
    observation_variances: Array = asked('include="observation_variances"')
    covariance: Array = asked('include="covariance"')
    gradients: Array = asked('include="gradients"')
    gradient_variances: Array = asked('include="gradient_variances"')
    samples: Array = asked("samples=10")
    quantiles: Array = asked("quantiles=[0.05, 0.95]")
    exceedance_probabilities: Array = asked("threshold=0")
    log_marginal_likelihoods: Array = asked('include="log_marginal_likelihood"')
    mean_coefficients: Array | None = None
    diagnostics: Diagnostics
    fit: ValuesFit

    SUMMARY: ClassVar = ("means", "gradients")
