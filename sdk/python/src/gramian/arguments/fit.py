"""Options that operations share: the fit of a function to a cloud, and the surface that is meant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Required, SupportsFloat, TypeAlias, TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from ..rest import models
from ..rest.models import (
    Diagnostics,
    DuplicatePolicy,
    GeometryAttribute,
    KernelDescription,
    KernelFamily,
    KernelUsed,
    MeanChoice,
    MeshAttribute,
    MeshQuality,
    OrientationChoice,
    PosteriorQuantity,
    PosteriorTarget,
    SolverChoice,
    SolverUsed,
    SurfaceModelChoice,
    SurfaceModelUsed,
    ValueAttribute,
)
from ..rest.types import Unset
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
Solver: TypeAlias = SolverChoice | SolverUsed | Literal["auto", "dense", "landmark", "iterative", "local"]
Duplicates: TypeAlias = DuplicatePolicy | Literal["refuse", "merge"]
SurfaceModel: TypeAlias = SurfaceModelChoice | SurfaceModelUsed | Literal["auto", "signature", "offset", "regression"]
Std: TypeAlias = ValueAttribute | Literal["std"]
GeometryWord: TypeAlias = GeometryAttribute | Literal["std", "edge_normals"]
MeshWord: TypeAlias = MeshAttribute | Literal["curvatures", "std"]
Quality: TypeAlias = MeshQuality | Literal["regular", "raw"]
Mean: TypeAlias = MeanChoice | Literal["zero", "constant", "linear"]
Orientation: TypeAlias = OrientationChoice | Literal["outward", "gradient"]
Quantity: TypeAlias = (
    PosteriorQuantity
    | Literal[
        "variances",
        "observation_variances",
        "covariance",
        "gradients",
        "gradient_variances",
        "log_marginal_likelihood",
    ]
)
Of: TypeAlias = PosteriorTarget | Literal["function", "observation"]


class KernelParameters(TypedDict, total=False):
    """The parameters of a kernel. `Kernel` documents them."""

    length_scale: Number | None
    length_scales: npt.ArrayLike | Unset | None
    variance: Number | None
    epsilon: Number | None
    nu: Number | None
    smoothness: Whole | Unset | None


@suggest_names
@dataclass(frozen=True, init=False, repr=False)
class Kernel:
    """A kernel `k(x, y) = variance · φ(r²)`.

    Here `r = |x − y|/length_scale` or `r² = Σ (x_c − y_c)²/length_scales_c²`. The service chooses parameters
    that are None. `Client.kernels()` lists the families with their formulas. `gauss` is exp(−r²): scikit-learn's
    `RBF(length_scale=l)`, exp(−r²/2), is `gauss` with `length_scale` √2 l.

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

    def __init__(self, family: Family, **parameters: Unpack[KernelParameters]) -> None:
        """Takes the parameters that the family allows. The attributes describe them."""
        given: dict[str, Any] = normalise({"family": family, **parameters}, KERNEL, path="kernel.")
        given["family"] = KernelFamily(given["family"])
        if "length_scales" in given:
            given["length_scales"] = tuple(given["length_scales"].tolist())
        for name in KERNEL:
            object.__setattr__(self, name, given.get(name))

    def __repr__(self) -> str:
        return described("Kernel", vars(self))


class KernelFields(KernelParameters, total=False):
    """A kernel as a dictionary: `{"family": "gauss", "length_scale": 2.0}`. `Kernel` documents the keys."""

    family: Required[Family]


KernelLike: TypeAlias = Family | Kernel | KernelUsed | KernelFields | models.Kernel | KernelDescription
"""A kernel: a family, a dictionary, a `Kernel`, or one from `diagnostics.kernel` or `Client.kernels()`."""


class Fit(TypedDict, total=False):
    """Options for fitting a function at the n points of a cloud, as keywords: `cloud.normals(**fit)`.

    The `fit` of an answer has all options as they were used. Every option may be absent, and None means
    absent. V is the unit of the values. A surface has none.

    Keys
    ----
    kernel : str, dict or Kernel, optional
        A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a
        dictionary), or the `diagnostics.kernel` of an answer. If absent, learned from the values by their
        likelihood, with its variance and the noise. Without values, as for a surface, chosen from the cloud.
        `diagnostics` reports it.
    alpha : float, optional
        Number added to the diagonal of the Gram matrix, V². 0 interpolates, the noise variance regresses. If
        absent, 1e-10 where `kernel` is given, else learned from the values. For a surface, chosen by the
        noise of the points, at least 1e-3.
    noise_variances : array_like, `[n]`, optional
        The noise variance at each point, V², instead of `alpha`.
    solver : str, optional
        `"dense"`; `"landmark"` for smooth kernels on up to millions of points; `"iterative"` for rough
        kernels on up to a hundred thousand; `"local"` to answer each query from the points nearest to it, for
        any number of points; or `"auto"` (if absent) to let the service choose. Local regressions of surfaces
        take neither `kernel` nor `alpha`.
    tolerance : float, optional
        The largest relative residual of an answer of the solver `"iterative"`: 1e-8 if absent.
    duplicates : str, optional
        Policy for points that coincide when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.
    """

    kernel: KernelLike | None
    alpha: Number | None
    noise_variances: npt.ArrayLike | None
    solver: Solver | None
    tolerance: Number | None
    duplicates: Duplicates | None


class ValuesFit(Fit, total=False):
    """Options for fitting a function to values, as keywords: `cloud.interpolate(values, **fit)`.

    Keys
    ----
    mean : str, optional
        Mean of the function, beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the coordinates. If
        absent, a constant where `kernel` is learned, else zero.
    """

    mean: Mean | None


@suggest_names
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Surface:
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
    model
        The function whose level set is the surface.
    """

    cloud: RegisteredCloud | str | None = None
    kernel: KernelLike | None = None
    alpha: Number | None = None
    noise_variances: npt.ArrayLike | None = None
    solver: Solver | None = None
    model: SurfaceModel | None = None

    def __repr__(self) -> str:
        return described("Surface", vars(self))


class SurfaceFields(TypedDict, total=False):
    """A surface as a dictionary: `{"kernel": "gauss", "alpha": 1e-8}`. `Surface` documents the keys."""

    cloud: RegisteredCloud | str | None
    kernel: KernelLike | None
    alpha: Number | None
    noise_variances: npt.ArrayLike | None
    solver: Solver | None
    model: SurfaceModel | None


SurfaceLike: TypeAlias = "Surface | SurfaceFields | Diagnostics | RegisteredCloud"
"""A surface: a `Surface`, a dictionary, another cloud, or what `diagnostics.surface` reports."""
