"""What the operations have in common: how a function is fitted to a cloud, and which surface is meant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Required, SupportsFloat, TypeAlias, TypedDict, cast

import numpy as np
import numpy.typing as npt

from ..rest import models
from ..rest.models import (
    Diagnostics,
    DuplicatePolicy,
    GeometryInclude,
    KernelDescription,
    KernelFamily,
    KernelUsed,
    MeanChoice,
    OrientationChoice,
    PosteriorQuantity,
    SolverChoice,
    SolverUsed,
    SurfaceChoice,
)
from ..rest.types import Unset
from ..wire.tensors import Array
from .describe import described
from .keywords import suggest_names
from .normalise import KERNEL, normalise

if TYPE_CHECKING:
    from .registration import RegisteredCloud

Number: TypeAlias = SupportsFloat | Unset
"""A real number: of Python or NumPy, an array without axes, a fraction; what `diagnostics` has. No bool or complex."""

Whole: TypeAlias = int | np.integer[Any] | npt.NDArray[np.integer[Any]]
"""A whole number: of Python or NumPy, an array without axes."""

# Every enumeration of the service may also be given as a plain string; tests/test_types.py compares the two.
Family: TypeAlias = KernelFamily | Literal["gauss", "laplace", "matern", "wendland", "inverse_multiquadric"]
Solver: TypeAlias = SolverChoice | SolverUsed | Literal["auto", "dense", "local"]
Duplicates: TypeAlias = DuplicatePolicy | Literal["refuse", "merge"]
Surface: TypeAlias = SurfaceChoice | Literal["auto", "signature", "offset", "local"]
Deviations: TypeAlias = GeometryInclude | Literal["deviations"]
Mean: TypeAlias = MeanChoice | Literal["zero", "constant", "linear"]
Orientation: TypeAlias = OrientationChoice | Literal["outward", "gradient"]
Quantity: TypeAlias = (
    PosteriorQuantity
    | Literal[
        "variance",
        "observation_variance",
        "covariance",
        "gradients",
        "gradient_variances",
        "log_marginal_likelihood",
    ]
)


@suggest_names
@dataclass(frozen=True, init=False, repr=False)
class Kernel:
    """A kernel `k(x, y) = variance · φ(r²)`, `r = |x − y|/length_scale` or `r² = Σ (x_c − y_c)²/length_scales_c²`.

    What is None is chosen by the service. `Client.kernels()` lists the families with their formulas.

    Attributes
    ----------
    family
        What determines φ.
    length_scale
        ℓ, unit of the coordinates; chosen from the cloud if absent.
    length_scales
        `[d]`, instead: a length scale for each axis, in the units of the coordinates.
    variance
        The factor of φ, unit of the values squared; 1 if absent.
    epsilon
        Of `laplace`: φ = exp(−√(r² + epsilon)); 0 if absent.
    nu
        Of `matern`: one of 0.5, 1.5, …, 8.5; 2.5 if absent.
    smoothness
        Of `wendland`: 2, 4 or 6 times differentiable; 4 if absent.

    Examples
    --------
    >>> gramian.Kernel("gauss", length_scale=np.float32(2))
    Kernel(family='gauss', length_scale=2.0)
    >>> gramian.Kernel("matern", length_scales=np.array([1, 0.5]))
    Kernel(family='matern', length_scales=(1.0, 0.5))
    """

    family: KernelFamily
    length_scale: float | None
    length_scales: tuple[float, ...] | None
    variance: float | None
    epsilon: float | None
    nu: float | None
    smoothness: int | None

    def __init__(
        self,
        family: Family,
        *,
        length_scale: Number | None = None,
        length_scales: npt.ArrayLike | Unset | None = None,
        variance: Number | None = None,
        epsilon: Number | None = None,
        nu: Number | None = None,
        smoothness: Whole | Unset | None = None,
    ) -> None:
        """Takes the parameters, of which the family allows some; see the attributes."""
        scales = {"length_scale": length_scale, "length_scales": length_scales}
        numbers = {"variance": variance, "epsilon": epsilon, "nu": nu, "smoothness": smoothness}
        given: dict[str, Any] = normalise({"family": family, **scales, **numbers}, KERNEL, path="kernel.")
        given["family"] = KernelFamily(given["family"])
        if "length_scales" in given:
            given["length_scales"] = tuple(given["length_scales"].tolist())
        for name in KERNEL:
            object.__setattr__(self, name, given.get(name))

    def __repr__(self) -> str:
        return described("Kernel", vars(self))


class KernelFields(TypedDict, total=False):
    """A kernel as a dictionary: `{"family": "gauss", "length_scale": 2.0}`. `Kernel` documents the parameters."""

    family: Required[Family]
    length_scale: Number | None
    length_scales: npt.ArrayLike | None
    variance: Number | None
    epsilon: Number | None
    nu: Number | None
    smoothness: Whole | None


KernelLike: TypeAlias = Family | Kernel | KernelUsed | KernelFields | models.Kernel | KernelDescription
"""A kernel: a family, a dictionary, one of one's own, or what `diagnostics.kernel` or `Client.kernels()` reports."""


class Fit(TypedDict, total=False):
    """How a function is fitted to values at the n points of a cloud, as keywords: `cloud.normals(**fit)`.

    `fit` of an answer is one, with all that was used. Everything is optional, None is as absent.

    Keys
    ----
    kernel
        Chosen from the cloud if absent, and repeated in `diagnostics.kernel`.
    alpha
        Added to the diagonal of the Gram matrix, unit of the values squared: 0 interpolates, the variance of the
        noise regresses. Absent: 1e-10 with a kernel given; without one, chosen by the noise of the values, or, for
        surfaces, of the points.
    noise_variances
        `[n]`, the variance of the noise at each point, instead of `alpha`.
    solver
        How the linear system is solved; `"auto"` if absent.
    duplicates
        What to do with points that coincide when alpha is 0: `"refuse"` them (if absent) or `"merge"` them.
    """

    kernel: KernelLike | None
    alpha: Number | None
    noise_variances: npt.ArrayLike | None
    solver: Solver | None
    duplicates: Duplicates | None


@suggest_names
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Geometry:
    """The surface of an operator, where it differs from the fit of the values. What is absent is as for the values.

    Attributes
    ----------
    cloud
        The cloud whose level surface carries the operator, `[k, d]`, or its id; its points are the default queries.
    kernel
        The kernel of its signature function.
    alpha
        Added to the diagonal of its Gram matrix; the signature function has no unit.
    noise_variances
        `[k]`, instead of `alpha`.
    solver
        How its linear system is solved.
    surface
        Which function's level surface is meant.
    """

    cloud: RegisteredCloud | str | None = None
    kernel: KernelLike | None = None
    alpha: Number | None = None
    noise_variances: npt.ArrayLike | None = None
    solver: Solver | None = None
    surface: Surface | None = None

    def __repr__(self) -> str:
        return described("Geometry", vars(self))


class GeometryFields(TypedDict, total=False):
    """A geometry as a dictionary: `{"kernel": "gauss", "alpha": 1e-8}`. `Geometry` documents the keys."""

    cloud: RegisteredCloud | str | None
    kernel: KernelLike | None
    alpha: Number | None
    noise_variances: npt.ArrayLike | None
    solver: Solver | None
    surface: Surface | None


GeometryLike: TypeAlias = "Geometry | GeometryFields | Diagnostics | RegisteredCloud"
"""A surface: of one's own, that of another cloud, one that `diagnostics.geometry` reports, or a dictionary."""


class ValuesFit(Fit, total=False):
    """How a function is fitted to values, as keywords: `cloud.interpolate(values, **fit)`.

    Keys
    ----
    mean
        What the function is made of beside the kernel: `"zero"`, `"constant"` or `"linear"`.
    """

    mean: Mean | None


class OperatorFit(ValuesFit, total=False):
    """How a function and a surface are fitted, as keywords: `cloud.laplace_beltrami(values, **fit)`.

    Keys
    ----
    geometry
        The surface, where it differs from the fit of the values.
    """

    geometry: GeometryLike | None


def fit_used(diagnostics: Diagnostics, request: Mapping[str, Any]) -> Fit:
    """Returns the fit of a surface that an answer says was used, with what only the request says."""
    fit = _numbers_used(diagnostics, request)
    if diagnostics.solver is SolverUsed.LOCAL:  # regressions that choose these by their likelihood, and take none
        fit.pop("kernel", None)
        fit.pop("alpha", None)
        fit.pop("noise_variances", None)
    return fit


def values_fit_used(diagnostics: Diagnostics, request: Mapping[str, Any]) -> ValuesFit:
    """Returns that of values, with the mean if there is one; their local solver takes a kernel as the other does."""
    mean = diagnostics.mean_coefficients
    return _with_mean(_numbers_used(diagnostics, request), 0 if isinstance(mean, Unset) else len(mean))


def batch_fit_used(diagnostics: Diagnostics, request: Mapping[str, Any], mean_coefficients: Array | None) -> ValuesFit:
    """Returns that of many lists of values, whose means have a row each."""
    fit = _numbers_used(diagnostics, request)
    return _with_mean(fit, 0 if mean_coefficients is None else mean_coefficients.shape[-1])


def selected_fit(start: ValuesFit, kernel: KernelUsed, alpha: float | None) -> ValuesFit:
    """Returns the fit that a search ended with, from that which it began with."""
    fit = start.copy()
    fit["kernel"] = kernel
    if alpha is not None:
        fit["alpha"] = alpha
    return fit


def _with_mean(fit: Fit, n_coefficients: int) -> ValuesFit:
    values_fit = cast("ValuesFit", fit)
    if n_coefficients:
        values_fit["mean"] = MeanChoice.CONSTANT if n_coefficients == 1 else MeanChoice.LINEAR
    return values_fit


def _numbers_used(diagnostics: Diagnostics, request: Mapping[str, Any]) -> Fit:
    fit = Fit(kernel=diagnostics.kernel, solver=diagnostics.solver)
    if isinstance(diagnostics.alpha, Unset):
        fit["noise_variances"] = _own_copy(request.get("noise_variances"))
    else:
        fit["alpha"] = diagnostics.alpha
    if "duplicates" in request:
        fit["duplicates"] = DuplicatePolicy(request["duplicates"])
    return fit


def operator_fit_used(diagnostics: Diagnostics, request: Mapping[str, Any]) -> OperatorFit:
    """Returns the same with the surface's fit."""
    fit, surface = values_fit_used(diagnostics, request), diagnostics.geometry
    if isinstance(surface, Unset):  # by stencils, which fit nothing to the values
        surface = diagnostics
        fit = ValuesFit(solver=SolverChoice.LOCAL)
        if "duplicates" in request:
            fit["duplicates"] = DuplicatePolicy(request["duplicates"])
    asked = request.get("geometry", {})
    noise_variances = asked.get("noise_variances", request.get("noise_variances"))
    cloud = None if surface.cloud_id == request["cloud"]["id"] else surface.cloud_id
    choice = SurfaceChoice(asked["surface"]) if "surface" in asked else None
    if surface.solver is SolverUsed.LOCAL:
        # It takes no kernel, not even that of the values, which therefore was the service's choice, and will be again.
        fit.pop("kernel", None)
        fit.pop("alpha", None)
        return OperatorFit(**fit, geometry=Geometry(cloud=cloud, solver=surface.solver, surface=choice))
    geometry = Geometry(
        cloud=cloud,
        kernel=surface.kernel,
        alpha=None if isinstance(surface.alpha, Unset) else surface.alpha,
        noise_variances=_own_copy(noise_variances) if isinstance(surface.alpha, Unset) else None,
        solver=surface.solver,
        surface=choice,
    )
    return OperatorFit(**fit, geometry=geometry)


def _own_copy(numbers: npt.ArrayLike | None) -> npt.NDArray[np.float64] | None:
    """Returns numbers that stay as they were sent, whatever the caller does to theirs."""
    if numbers is None:
        return None
    copy = np.array(numbers, dtype=np.float64)
    copy.flags.writeable = False
    return copy
