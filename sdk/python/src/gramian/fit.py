"""What the operations have in common: how a function is fitted to a cloud, and which surface is meant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Required, TypeAlias, TypedDict

import numpy as np
import numpy.typing as npt

from .rest.models import (
    DuplicatePolicy,
    Kernel,
    KernelFamily,
    KernelUsed,
    OrientationChoice,
    PosteriorQuantity,
    SolverChoice,
    SurfaceChoice,
)
from .tensors import Array

if TYPE_CHECKING:
    from .cloud import Cloud

# Every enumeration of the service may also be given as a plain string; tests/test_types.py compares the two.
Family: TypeAlias = KernelFamily | Literal["gauss", "laplace", "matern", "wendland", "inverse_multiquadric"]
Solver: TypeAlias = SolverChoice | Literal["auto", "dense"]
Duplicates: TypeAlias = DuplicatePolicy | Literal["refuse", "merge"]
Surface: TypeAlias = SurfaceChoice | Literal["auto", "signature", "offset"]
Orientation: TypeAlias = OrientationChoice | Literal["outward", "gradient"]
Quantity: TypeAlias = (
    PosteriorQuantity
    | Literal["variance", "observation_variance", "covariance", "gradients", "log_marginal_likelihood"]
)


class KernelFields(TypedDict, total=False):
    """A kernel as a dictionary: `{"family": "gauss", "length_scale": 2.0}`.

    `k(x, y) = variance · φ(|x − y|²/length_scale²)`; `Kernel` documents the parameters, `Client.kernels()` the
    families.
    """

    family: Required[Family]
    length_scale: float
    variance: float
    epsilon: float
    nu: float
    smoothness: Literal[2, 4, 6]


KernelLike: TypeAlias = Kernel | KernelUsed | KernelFields
"""A kernel: of one's own, one that `diagnostics.kernel` reports, or a dictionary."""


class Fit(TypedDict, total=False):
    """How a function is fitted to values at the n points of a cloud. Everything is optional, None is as absent.

    Keys:
        kernel: Chosen from the cloud if absent, and repeated in `diagnostics.kernel`.
        alpha: Added to the diagonal of the Gram matrix, unit of the values squared: 0 interpolates, the variance of the
            noise regresses. Absent: 1e-10 for values or with a kernel given; for surfaces without one, chosen by the
            noise of the points.
        noise_variances: `[n]`, the variance of the noise at each point, instead of `alpha`.
        solver: How the linear system is solved; `"auto"` if absent.
        duplicates: What to do with points that coincide when alpha is 0: `"refuse"` them (if absent) or `"merge"` them.
    """

    kernel: KernelLike | None
    alpha: float | None
    noise_variances: npt.ArrayLike | None
    solver: Solver | None
    duplicates: Duplicates | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Geometry:
    """The surface of an operator, where it differs from the fit of the values. What is absent is as for the values.

    Attributes:
        cloud: The cloud whose level surface carries the operator, `[k, d]`; its points are the default queries.
        kernel: The kernel of its signature function.
        alpha: Added to the diagonal of its Gram matrix.
        noise_variances: `[k]`, instead of `alpha`.
        solver: How its linear system is solved.
        surface: Which function's level surface is meant.
    """

    cloud: Cloud | None = None
    kernel: KernelLike | None = None
    alpha: float | None = None
    noise_variances: npt.ArrayLike | None = None
    solver: Solver | None = None
    surface: Surface | None = None

    def fields(self) -> dict[str, object]:
        """Returns the field `geometry` of a request."""
        fit = Fit(kernel=self.kernel, alpha=self.alpha, noise_variances=self.noise_variances, solver=self.solver)
        cloud = None if self.cloud is None else {"id": self.cloud.id}
        return given(cloud=cloud, surface=self.surface, **fit_fields(fit))


def fit_fields(fit: Fit) -> dict[str, object]:
    """Returns the fields of a request that say how to fit."""
    fields: dict[str, object] = {name: _plain(value) for name, value in fit.items()}
    kernel, noise_variances = fit.get("kernel"), fit.get("noise_variances")
    if isinstance(kernel, Kernel | KernelUsed):
        fields["kernel"] = kernel.to_dict()
    elif kernel is not None:
        fields["kernel"] = {name: _plain(value) for name, value in kernel.items()}
    if noise_variances is not None:
        fields["noise_variances"] = as_list("noise_variances", noise_variances)
    return fields


def _plain(value: object) -> object:
    """Returns a number of NumPy as one of Python."""
    return value.item() if isinstance(value, np.generic) else value


def given(**fields: object) -> dict[str, object]:
    """Returns the fields that are not None: the service takes no null."""
    return {name: value for name, value in fields.items() if value is not None}


def as_list(name: str, values: npt.ArrayLike) -> Array:
    """Returns numbers of the shape `[n]`."""
    return _as_array(name, values, "[n]")


def as_rows(name: str, points: npt.ArrayLike) -> Array:
    """Returns points of the shape `[n, d]`, one row of coordinates each."""
    return _as_array(name, points, "[n, d]")


def _as_array(name: str, numbers: npt.ArrayLike, shape: Literal["[n]", "[n, d]"]) -> Array:
    """Returns an array as it is sent, without a copy if it is one already.

    Shape and finiteness are checked here, since one way of writing a request could not say NaN at all, and the service
    would report a wrong shape row by row. All else is for the service to refuse.
    """
    array = np.asarray(numbers, dtype="<f8", order="C")
    if array.ndim != shape.count(",") + 1:
        raise ValueError(f"{name} must have the shape {shape}, not {list(array.shape)}")
    if not np.isfinite(array).all():
        first = np.argwhere(~np.isfinite(array))[0].tolist()
        raise ValueError(f"{name}{first} is not finite")
    return array
