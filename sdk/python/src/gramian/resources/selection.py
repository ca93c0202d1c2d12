"""Selection of the kernel and the noise that explain values at the points of a cloud."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal, Required, TypeAlias, TypedDict, Unpack

import numpy.typing as npt

from ..answers import ModelSelection
from ..arguments.fit import Family, Number, ValuesFit, Whole
from ..arguments.keywords import suggest_names
from ..arguments.registration import RegisteredCloud
from ..rest.models import FreeParameter, SelectionCriterion, SelectionParameter

Criterion: TypeAlias = (
    SelectionCriterion | Literal["marginal_likelihood", "leave_one_out", "generalized_cross_validation"]
)
Parameter: TypeAlias = (
    SelectionParameter | Literal["length_scale", "length_scales", "variance", "alpha", "epsilon", "nu"]
)


class Bounds(TypedDict, total=False):
    """Free parameters, each with its least and greatest value: `{"length_scale": (0.1, 10)}`.

    Keys
    ----
    length_scale
        Length scale of the kernel, unit of the coordinates.
    length_scales
        Length scales of the kernel, a separate one for every axis, each within these bounds.
    variance
        Variance of the kernel, V².
    alpha
        Variance of the noise, V².
    epsilon
        Parameter of `laplace`.
    nu
        Parameter of `matern`. Each half-integer within the bounds is tried.
    """

    length_scale: npt.ArrayLike | None
    length_scales: npt.ArrayLike | None
    variance: npt.ArrayLike | None
    alpha: npt.ArrayLike | None
    epsilon: npt.ArrayLike | None
    nu: npt.ArrayLike | None


class FreeParameterFields(TypedDict, total=False):
    """A free parameter as a dictionary: `{"parameter": "length_scales", "axis": 0, "min": 0.1, "max": 10}`.

    Keys
    ----
    parameter
        Name of the parameter, a key of `Bounds`.
    axis
        Axis of `length_scales`, counted from 0. If absent, every axis, each within these bounds.
    min, max
        Least and greatest value.
    """

    parameter: Required[Parameter]
    axis: Whole | None
    min: Required[Number]
    max: Required[Number]


Vary: TypeAlias = Bounds | Mapping[SelectionParameter, npt.ArrayLike] | Iterable[FreeParameterFields | FreeParameter]
"""Free parameters: bounds by name, or a list of parameters, each with an axis where needed."""


@suggest_names
class SelectionOnCloud(RegisteredCloud):
    """The part of `Cloud` that selects models. V is the unit of the values."""

    def select_model(
        self,
        values: npt.ArrayLike,
        *,
        criterion: Criterion | None = None,
        vary: Vary | None = None,
        families: Family | Iterable[Family] | None = None,
        restarts: Whole | None = None,
        seed: Whole | None = None,
        **options: Unpack[ValuesFit],
    ) -> ModelSelection:
        """Searches for the kernel and the noise that explain values best.

        The search begins with `kernel` and `alpha`, and again from other starts within the bounds. It follows
        the slopes of the criterion. With `noise_variances`, alpha is not searched. The solver is dense, and
        points are not merged. `gramian.ValuesFit` describes the options of the fit.

        Parameters
        ----------
        values : array_like, `[n]`
            Values at the points, in their order, unit V.
        criterion : str, optional
            Criterion to maximize: `"marginal_likelihood"` (if absent); `"leave_one_out"` for the log
            densities of each value given all others; or `"generalized_cross_validation"`, which depends only
            on the ratio of variance and alpha.
        vary : dict or list, optional
            Free parameters and their bounds: `{"length_scales": (0.1, 10), "alpha": (1e-6, 1)}`, as
            `gramian.Bounds` documents, or a list of
            `{"parameter": "length_scales", "axis": 0, "min": 0.1, "max": 10}`. If absent, the length scale
            (or that of each axis, where `kernel` has them), the variance and, without `noise_variances`,
            alpha. Their bounds are then a hundredth (alpha: a millionth) and a hundred times the values at
            the start.
        families : str or several, optional
            Families to try. The family of `kernel` starts from its parameters. If absent, only that family is
            tried.
        restarts : int, optional
            Number of further starts for each family, at most 100. 2 if absent.
        seed : int, optional
            Seed of the further starts. 0 if absent.

        Returns
        -------
        ModelSelection
            The selected `kernel` and `alpha`, the criterion over alpha, and each value predicted from all
            others.

        Examples
        --------
        >>> random = np.random.default_rng(0)
        >>> points = random.uniform(size=(80, 2))
        >>> values = np.sin(9 * points[:, 0]) + 0.1 * random.normal(size=80)  # whatever the second coordinate is
        >>> cloud = gramian.Client().cloud(points)
        >>> vary = {"length_scales": (0.01, 10), "variance": (0.01, 100), "alpha": (1e-6, 1)}
        >>> found = cloud.select_model(values, vary=vary, families=["gauss", "matern"])
        >>> found.kernel.length_scales[0] < 0.5 < 5 < found.kernel.length_scales[1], np.sqrt(found.alpha).round(1)
        (True, np.float64(0.1))
        >>> cloud.posterior(values, [[0.5, 0.5]], **found.fit).means.round(1)  # with what was selected
        array([-1.])
        """
        return self._compute(
            ModelSelection.read,
            "/v1/model-selection",
            values=values,
            criterion=criterion,
            vary=vary,
            families=families,
            restarts=restarts,
            seed=seed,
            **options,
        )
