"""Which kernel and noise explain values at the points of a cloud."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal, Required, TypeAlias, TypedDict

import numpy.typing as npt

from ..answers import ModelSelection
from ..arguments.fit import Duplicates, Family, KernelLike, Mean, Number, Solver, Whole
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
    """What is free, each with the least and the greatest that it may be: `{"length_scale": (0.1, 10)}`.

    Keys
    ----
    length_scale
        Of the kernel, unit of the coordinates.
    length_scales
        Of the kernel, of every axis its own, each within these bounds.
    variance
        Of the kernel, V².
    alpha
        The variance of the noise, V².
    epsilon
        Of `laplace`.
    nu
        Of `matern`: each half-integer within the bounds is tried.
    """

    length_scale: npt.ArrayLike | None
    length_scales: npt.ArrayLike | None
    variance: npt.ArrayLike | None
    alpha: npt.ArrayLike | None
    epsilon: npt.ArrayLike | None
    nu: npt.ArrayLike | None


class FreeParameterFields(TypedDict, total=False):
    """A parameter that is free, as a dictionary: `{"parameter": "length_scales", "axis": 0, "min": 0.1, "max": 10}`.

    Keys
    ----
    parameter
        Which: a key of `Bounds`.
    axis
        Of `length_scales`: which, from 0; every axis if absent, each within these bounds.
    min, max
        The least and the greatest that it may be.
    """

    parameter: Required[Parameter]
    axis: Whole | None
    min: Required[Number]
    max: Required[Number]


Vary: TypeAlias = Bounds | Mapping[SelectionParameter, npt.ArrayLike] | Iterable[FreeParameterFields | FreeParameter]
"""What is free: bounds by name, or a list of parameters with an axis where need be."""


@suggest_names
class SelectionOnCloud(RegisteredCloud):
    """The part of `Cloud` that selects models; V is the unit of the values."""

    def select_model(
        self,
        values: npt.ArrayLike,
        *,
        criterion: Criterion | None = None,
        vary: Vary | None = None,
        families: Family | Iterable[Family] | None = None,
        restarts: Whole | None = None,
        seed: Whole | None = None,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        mean: Mean | None = None,
        noise_variances: npt.ArrayLike | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
    ) -> ModelSelection:
        """Searches the kernel and the noise that explain values best.

        The search begins with `kernel` and `alpha`, and again from further places within the bounds, and follows the
        slopes of the criterion.

        Parameters
        ----------
        values : array_like, `[n]`
            At the points, in their order, unit V.
        criterion : str, optional
            What is made as great as possible: `"marginal_likelihood"`, as if absent, `"leave_one_out"` for the log
            densities of each value given all others, or `"generalized_cross_validation"`, for which variance and alpha
            only count by their ratio.
        vary : dict or list, optional
            What is free, and its bounds: `{"length_scales": (0.1, 10), "alpha": (1e-6, 1)}`, as `gramian.Bounds`
            documents, or a list of `{"parameter": "length_scales", "axis": 0, "min": 0.1, "max": 10}`. If absent,
            length scale (or that of each axis, where `kernel` has them), variance and, without `noise_variances`,
            alpha, from a hundredth (alpha: a millionth) to a hundred times of where the search begins.
        families : str or several, optional
            What is tried, with the parameters of `kernel` where it is of that family; its family alone if absent.
        restarts : int, optional
            How many further places the search begins from for each family, at most 100; 2 if absent.
        seed : int, optional
            Where these are; 0 if absent.
        kernel : str, dict or Kernel, optional
            Where the search begins: a family (`"gauss"`), its parameters (`gramian.Kernel("gauss", length_scale=2)` or
            as a dictionary), or the `diagnostics.kernel` of an answer. If absent, learned from the values by their
            likelihood, with its variance and the noise.
        alpha : float, optional
            Where the search begins: the variance of the noise, V². If absent, 1e-10 with a kernel given, else learned
            from the values.
        mean : str, optional
            What the function is made of beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the coordinates. A
            constant if absent with `kernel`, else zero.
        noise_variances : array_like, `[n]`, optional
            The variance of the noise at each point, V², instead of `alpha`, which then is not searched.
        solver : str, optional
            `"dense"`, or `"auto"`, which is the same here, as if absent.
        duplicates : str, optional
            What to do with points that coincide when `alpha` is 0: `"refuse"` them, as if absent. They are not merged
            here.

        Returns
        -------
        ModelSelection
            The `kernel` and `alpha` selected, the criterion over alpha, and each value predicted from all others.

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
            kernel=kernel,
            alpha=alpha,
            mean=mean,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
        )
