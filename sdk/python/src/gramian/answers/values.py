"""Functions through values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

from ..arguments.describe import described
from ..arguments.fit import ValuesFit
from ..rest.models import Diagnostics
from ..wire.tensors import Array, Members
from .answer import Answer
from .asked import asked
from .fit import values_fit_used


@dataclass(frozen=True, eq=False, repr=False)
class Data:
    """What a function was fitted to.

    Attributes
    ----------
    points
        `[n, d]`, L. The points of the cloud.
    values
        `[n]`, or `[k, n]` for several lists, V. The values at the points.
    """

    points: Array
    values: Array

    def __repr__(self) -> str:
        return described("Data", vars(self))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ValuesAnswer(Answer):
    """The base class of answers about functions through values.

    Attributes
    ----------
    data
        The points and the values, which pictures show. None if the client has no copy of the points.
    """

    data: Data | None = None

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer, the options of its fit and its data."""
        data = data_of(members, derived.get("points"))
        return super().read(members, fit=values_fit_used(members), data=data, **derived)


def data_of(members: Members, points: Any) -> Data | None:  # noqa: ANN401 (Array or None)
    """Returns the data of a request about a cloud with these points."""
    if points is None or "values" not in members.request:
        return None
    values = members.request["values"].view()
    values.flags.writeable = False
    return Data(points, values)


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
    value_std
        `[m]`, V, with `std`. Standard deviations of `values` given the data.
    gradient_std
        `[m, d]`, V/L, with `std`. Standard deviations of the components of ∇u.
    hessian_std
        `[m, d, d]`, V/L², with `std`. Standard deviations of the entries of D²u.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    values: Array
    gradients: Array = asked("derivatives=1")
    hessians: Array = asked("derivatives=2")
    value_std: Array = asked("std=True")
    gradient_std: Array = asked("derivatives=1, std=True")
    hessian_std: Array = asked("derivatives=2, std=True")
    diagnostics: Diagnostics
    fit: ValuesFit

    SUMMARY: ClassVar = ("values", "gradients")


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Posterior(ValuesAnswer):
    """A Gaussian process given the values, at the queries.

    Quantities other than the means are present if the request asks for them.

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
    variances: Array = asked('include="variances"')
    observation_variances: Array = asked('include="observation_variances"')
    covariance: Array = asked('include="covariance"')
    gradients: Array = asked('include="gradients"')
    gradient_variances: Array = asked('include="gradient_variances"')
    samples: Array = asked("samples=10")
    quantiles: Array = asked("quantiles=[0.05, 0.95]")
    exceedance_probabilities: Array = asked("threshold=0")
    log_marginal_likelihood: float = asked('include="log_marginal_likelihood"')
    diagnostics: Diagnostics
    fit: ValuesFit

    SUMMARY: ClassVar = ("means", "gradients")
