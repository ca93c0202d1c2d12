"""Answers of model selection: the selected kernel and noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

from ..arguments.fit import ValuesFit
from ..rest.models import Diagnostics, FamilyScore, KernelUsed
from ..wire.tensors import Array, Members
from .answer import Answer
from .fit import selected_fit


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class AlphaPath(Answer):
    """The criterion over alpha, with everything else as selected.

    It has no entries if there are `noise_variances`.

    Attributes
    ----------
    alphas
        `[a]`, V², ascending.
    scores
        `[a]`. NaN where the matrix is not positive definite.
    """

    alphas: Array
    scores: Array

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads a list of objects as one array for each of their members."""
        columns = {f"{name}s": [entry.get(name) for entry in members["alpha_path"]] for name in ("alpha", "score")}
        return super().read(Members({}, columns, members.request), **derived)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class LeaveOneOut(Answer):
    """Predictions of each value from all others, with the selected kernel and noise.

    Entries are NaN where the mean is not determined without the point.

    Attributes
    ----------
    means
        `[n]`, V. The predictions, in the order of the points.
    variances
        `[n]`, V². Variances of the predicted values, including their noise.
    log_predictive_densities
        `[n]`. Logarithms of the densities (1/V) of the values under their predictions.
    """

    means: Array
    variances: Array
    log_predictive_densities: Array


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ModelSelection(Answer):
    """The kernel and the noise that explain values best.

    Attributes
    ----------
    kernel
        The selected kernel.
    alpha
        V². The selected noise variance. None with `noise_variances`.
    mean_coefficients
        `[p]`. The mean: the constant, V, then, if the mean is linear, a slope for each coordinate, V/L. None
        if the mean is zero.
    score
        The criterion for the selected kernel and noise. Greater is better.
    score_gradient
        Derivatives of the score by the logarithm of each free parameter, in the order of `vary`. For
        `length_scales` without an axis, by the logarithm of a common factor. NaN for `nu`, which is discrete.
    converged
        True if no slope is left to follow within the bounds.
    evaluations
        Number of evaluations of the criterion.
    families
        The families tried, with their best scores. Each `nu` of `matern` counts as a family.
    alpha_path
        The criterion over alpha: `alpha_path.alphas` and `alpha_path.scores`.
    leave_one_out
        Each value predicted from all others: `means`, `variances` and `log_predictive_densities`.
    diagnostics
        Diagnostics of the fit with which the search began.
    fit
        Options of the selected fit: `cloud.posterior(values, **answer.fit)` uses them.
    """

    kernel: KernelUsed
    alpha: float | None = None
    mean_coefficients: Array | None = None
    score: float
    score_gradient: Array
    converged: bool
    evaluations: int
    families: tuple[FamilyScore, ...]
    alpha_path: AlphaPath
    leave_one_out: LeaveOneOut
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads the answer of `/v1/model-selection`."""
        left_out = Members({}, members["leave_one_out"], members.request)
        parts = {"alpha_path": AlphaPath.read(members), "leave_one_out": LeaveOneOut.read(left_out)}
        return super().read(members, fit=selected_fit(members), **parts, **derived)

    def plot(self, ax: Any = None) -> Any:  # noqa: ANN401 (Axes, LikelihoodDisplay)
        """Draws the criterion over α, with the selected one."""
        from ..plot import LikelihoodDisplay

        return LikelihoodDisplay.from_answer(self).plot(ax)
