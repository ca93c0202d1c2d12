"""Answers of model selection: the selected kernel and noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy.typing as npt

from ..arguments.fit import ValuesFit
from ..export import Table
from ..rest.models import Diagnostics, FamilyScore, KernelUsed, SelectionCriterion
from ..rest.types import Unset
from ..wire.tensors import Array, Members
from .answer import Answer
from .fit import selected_fit
from .summary import kernel_in_words, origin_of, quantiles_of, warnings_of
from .values import Data, data_of


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

    ROWS: ClassVar = "a"
    SUMMARY: ClassVar = ("alphas", "scores")

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads a list of objects as one array for each of their members."""
        columns = {f"{name}s": [entry.get(name) for entry in members["alpha_path"]] for name in ("alpha", "score")}
        return super().read(Members({}, columns, members.request), **derived)

    def plot(self, ax: Any = None) -> Any:  # type: ignore[override]  # noqa: ANN401 (Axes, LikelihoodDisplay)
        """Draws the criterion over α. `ModelSelection.plot` also shows the selected one."""
        from ..plot import LikelihoodDisplay

        return LikelihoodDisplay(self.alphas, self.scores).plot(ax)


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
    data
        The points and the values, which pictures show. None if the client has no copy of the points.
    """

    means: Array
    variances: Array
    log_predictive_densities: Array
    data: Data | None = None

    ROWS: ClassVar = "n"
    SUMMARY: ClassVar = ("means", "log_predictive_densities")


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
    criterion
        What was maximized.
    score
        The criterion for the selected kernel and noise. Greater is better.
    score_gradient
        `[f]`. Derivatives of the score by the logarithm of each free parameter, in the order of `vary`. For
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
    criterion: SelectionCriterion
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
        data: dict[str, object] = {"data": data_of(members, derived.get("points"))}
        return super().read(
            members,
            fit=selected_fit(members),
            alpha_path=AlphaPath.read(members),
            leave_one_out=LeaveOneOut.read(left_out, positions=derived.get("positions"), **data),
            criterion=SelectionCriterion(members.request.get("criterion", SelectionCriterion.MARGINAL_LIKELIHOOD)),
            **derived,
        )

    def __str__(self) -> str:
        return "\n".join([*self._lines(), *warnings_of(self.diagnostics)])

    def _lines(self) -> Iterator[str]:
        yield f"Model Selection {origin_of(self.diagnostics)}"
        yield f"kernel: {kernel_in_words(self.kernel)}, variance {self.kernel.variance:.3g} V²"
        if self.alpha is not None:
            yield f"noise: {self.alpha**0.5:.3g} V, that is alpha {self.alpha:.3g} V²"
        state = f"{'' if self.converged else 'not '}converged after {self.evaluations} evaluations"
        yield f"{self.criterion.value.replace('_', ' ')}: {self.score:.6g}, {state}"
        yield f"families: {', '.join(map(_family_in_words, self.families))}"
        if self.leave_one_out.data:
            errors = self.leave_one_out.data.values - self.leave_one_out.means
            yield f"errors of predictions without the point: {quantiles_of(errors, 'V')}"

    def plot(self, ax: Any = None, *, value_unit: str = "V") -> Any:  # type: ignore[override]  # noqa: ANN401 (Axes, LikelihoodDisplay)
        """Draws the criterion over α, with the selected one. `leave_one_out.plot()` draws the predictions."""
        from ..plot import LikelihoodDisplay

        return LikelihoodDisplay.from_answer(self).plot(ax, value_unit=value_unit)

    def _table(self, positions: npt.ArrayLike | None, quantity: str | None) -> Table:
        return self.leave_one_out._table(positions, quantity)


def _family_in_words(said: FamilyScore) -> str:
    nu = "" if isinstance(said.nu, Unset) else f" of nu {said.nu:g}"
    score = "not positive definite" if said.score is None or isinstance(said.score, Unset) else f"{said.score:.6g}"
    return f"{said.family.value}{nu} {score}"
