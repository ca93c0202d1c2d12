"""Kernels and noise that were selected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from ..arguments.fit import ValuesFit, selected_fit, values_fit_used
from ..rest.models import Diagnostics, FamilyScore, KernelUsed
from ..wire.tensors import Array, Members
from .answer import Answer


@dataclass(frozen=True, eq=False, repr=False)
class AlphaPath(Answer):
    """The criterion over alpha, all else being as it was selected. Without entries if there are `noise_variances`.

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
    def read(cls, members: Members) -> Self:
        """Reads it from the answer of `/v1/model-selection`."""
        return cls(alphas=members.column("path", "alpha"), scores=members.column("path", "score"))


@dataclass(frozen=True, eq=False, repr=False)
class LeaveOneOut(Answer):
    """What each value is predicted to be from all others, with what was selected.

    NaN where the mean is not determined without the point.

    Attributes
    ----------
    means
        `[n]`, V. The predictions, in the order of the points.
    variances
        `[n]`, V². Of the values predicted, their noise included.
    log_predictive_densities
        `[n]`. Logarithms of the densities, 1/V, of the values under their predictions.
    """

    means: Array
    variances: Array
    log_predictive_densities: Array

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads it from the answer of `/v1/model-selection`."""
        left_out = members.within("leave_one_out")
        return cls(
            means=left_out.array("means"),
            variances=left_out.array("variances"),
            log_predictive_densities=left_out.array("log_predictive_densities"),
        )


@dataclass(frozen=True, eq=False, repr=False)
class ModelSelection(Answer):
    """The kernel and the noise that explain values best.

    Attributes
    ----------
    kernel
        The kernel that was selected.
    alpha
        V². The variance of the noise that was selected; None with `noise_variances`.
    mean_coefficients
        `[p]`. The mean: the constant, V, then a slope for each coordinate, V/L, if it is linear; None if it is zero.
    score
        The criterion there; greater is better.
    gradient
        A number for each entry of `vary`, in its order: the derivative of the score in the logarithm of what is free;
        for `length_scales` without an axis in that of a factor of all; NaN for `nu`, which takes steps.
    converged
        Whether no slope is left to follow within the bounds.
    evaluations
        How often the criterion was evaluated.
    families
        The families that were tried, each `nu` of `matern` by itself, with their best scores.
    path
        The criterion over alpha: `path.alphas` and `path.scores`.
    leave_one_out
        Each value predicted from all others: `means`, `variances` and `log_predictive_densities`.
    diagnostics
        Of the fit that the search began with.
    fit
        What was selected: `cloud.posterior(values, **answer.fit)` uses it.
    """

    kernel: KernelUsed
    alpha: float | None
    mean_coefficients: Array | None
    score: float
    gradient: Array
    converged: bool
    evaluations: int
    families: tuple[FamilyScore, ...]
    path: AlphaPath
    leave_one_out: LeaveOneOut
    diagnostics: Diagnostics
    fit: ValuesFit

    @classmethod
    def read(cls, members: Members) -> Self:
        """Reads the answer of `/v1/model-selection`."""
        fields, diagnostics = members.fields, members.diagnostics
        kernel, alpha = KernelUsed.from_dict(fields["kernel"]), fields.get("alpha")
        return cls(
            kernel=kernel,
            alpha=alpha,
            mean_coefficients=members.optional("mean_coefficients"),
            score=fields["score"],
            gradient=members.array("gradient"),
            converged=fields["converged"],
            evaluations=fields["evaluations"],
            families=tuple(FamilyScore.from_dict(entry) for entry in fields["families"]),
            path=AlphaPath.read(members),
            leave_one_out=LeaveOneOut.read(members),
            diagnostics=diagnostics,
            fit=selected_fit(values_fit_used(diagnostics, members.request), kernel, alpha),
        )
