"""Options that operations share: the fit of a function to a cloud, and the surface that is meant."""

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
"""A real number of Python or NumPy, an array without axes, a fraction, or `UNSET` as in `diagnostics`.

Not a bool or a complex number.
"""

Whole: TypeAlias = int | np.integer[Any] | npt.NDArray[np.integer[Any]]
"""A whole number of Python or NumPy, or an array without axes."""

# Every enumeration of the service may also be given as a plain string. tests/test_types.py compares the two.
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
    """A kernel `k(x, y) = variance · φ(r²)`.

    Here `r = |x − y|/length_scale` or `r² = Σ (x_c − y_c)²/length_scales_c²`. The service chooses parameters
    that are None. `Client.kernels()` lists the families with their formulas.

    Attributes
    ----------
    family
        The family, which determines φ.
    length_scale
        ℓ, unit of the coordinates. Chosen from the cloud if absent.
    length_scales
        `[d]`, instead of `length_scale`: one length scale for each axis, in the units of the coordinates.
    variance
        The factor of φ, unit of the values squared. 1 if absent.
    epsilon
        Parameter of `laplace`: φ = exp(−√(r² + epsilon)). 0 if absent.
    nu
        Parameter of `matern`: one of 0.5, 1.5, …, 8.5. 2.5 if absent.
    smoothness
        Parameter of `wendland`, the number of derivatives: 2, 4 or 6. 4 if absent.

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
        """Takes the parameters that the family allows. The attributes describe them."""
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
    """A kernel as a dictionary: `{"family": "gauss", "length_scale": 2.0}`. `Kernel` documents the keys."""

    family: Required[Family]
    length_scale: Number | None
    length_scales: npt.ArrayLike | None
    variance: Number | None
    epsilon: Number | None
    nu: Number | None
    smoothness: Whole | None


KernelLike: TypeAlias = Family | Kernel | KernelUsed | KernelFields | models.Kernel | KernelDescription
"""A kernel: a family, a dictionary, a `Kernel`, or one from `diagnostics.kernel` or `Client.kernels()`."""


class Fit(TypedDict, total=False):
    """Options for fitting a function at the n points of a cloud, as keywords: `cloud.normals(**fit)`.

    The `fit` of an answer has all options as they were used. Every option may be absent, and None means
    absent.

    Keys
    ----
    kernel
        The kernel. Chosen from the cloud if absent, and reported in `diagnostics.kernel`.
    alpha
        Number added to the diagonal of the Gram matrix, unit of the values squared. 0 interpolates, the noise
        variance regresses. If absent, 1e-10 where a kernel is given. Otherwise it is chosen by the noise of
        the values or, for surfaces, of the points.
    noise_variances
        `[n]`, the noise variance at each point, instead of `alpha`.
    solver
        The solver of the linear system. `"auto"` if absent.
    duplicates
        The policy for points that coincide when alpha is 0: `"refuse"` (if absent) or `"merge"`.
    """

    kernel: KernelLike | None
    alpha: Number | None
    noise_variances: npt.ArrayLike | None
    solver: Solver | None
    duplicates: Duplicates | None


@suggest_names
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Geometry:
    """The surface of an operator, where it differs from the fit of the values.

    Absent options are those of the fit of the values.

    Attributes
    ----------
    cloud
        The cloud whose level set carries the operator, `[k, d]`, or its id. Its points are the default
        queries.
    kernel
        The kernel of its signature function.
    alpha
        Number added to the diagonal of its Gram matrix. It has no unit, as the signature function has none.
    noise_variances
        `[k]`, the noise variance at each point, instead of `alpha`.
    solver
        The solver of its linear system.
    surface
        The function whose level set is the surface.
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
"""A surface: a `Geometry`, a dictionary, another cloud, or what `diagnostics.geometry` reports."""


class ValuesFit(Fit, total=False):
    """Options for fitting a function to values, as keywords: `cloud.interpolate(values, **fit)`.

    Keys
    ----
    mean
        The mean, the part of the function beside the kernel: `"zero"`, `"constant"` or `"linear"`.
    """

    mean: Mean | None


class OperatorFit(ValuesFit, total=False):
    """Options for fitting a function and a surface, as keywords: `cloud.laplace_beltrami(values, **fit)`.

    Keys
    ----
    geometry
        The surface, where it differs from the fit of the values.
    """

    geometry: GeometryLike | None


def fit_used(diagnostics: Diagnostics, request: Mapping[str, Any]) -> Fit:
    """Returns the fit of a surface as used, from an answer's diagnostics and its request."""
    fit = _numbers_used(diagnostics, request)
    if diagnostics.solver is SolverUsed.LOCAL:  # local regressions choose these by likelihood, and take none
        fit.pop("kernel", None)
        fit.pop("alpha", None)
        fit.pop("noise_variances", None)
    return fit


def values_fit_used(diagnostics: Diagnostics, request: Mapping[str, Any]) -> ValuesFit:
    """Returns the fit of values as used, with the mean if there is one.

    Unlike for surfaces, the local solver for values takes a kernel, so the kernel is kept.
    """
    mean = diagnostics.mean_coefficients
    return _with_mean(_numbers_used(diagnostics, request), 0 if isinstance(mean, Unset) else len(mean))


def batch_fit_used(diagnostics: Diagnostics, request: Mapping[str, Any], mean_coefficients: Array | None) -> ValuesFit:
    """Returns the fit of many lists of values as used. `mean_coefficients` has a row for each list."""
    fit = _numbers_used(diagnostics, request)
    return _with_mean(fit, 0 if mean_coefficients is None else mean_coefficients.shape[-1])


def selected_fit(start: ValuesFit, kernel: KernelUsed, alpha: float | None) -> ValuesFit:
    """Returns the fit with which a search ended, from the one with which it began."""
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
    """Returns the fit of values as used, with the fit of the surface."""
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
        # A local surface takes no kernel, not even that of the values. So the service chose the kernel of the
        # values, and will choose it again.
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
    """Returns a read-only copy of numbers, which the caller cannot change."""
    if numbers is None:
        return None
    copy = np.array(numbers, dtype=np.float64)
    copy.flags.writeable = False
    return copy
