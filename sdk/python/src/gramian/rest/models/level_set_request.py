from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..models.duplicate_policy import DuplicatePolicy
from ..models.mean_choice import MeanChoice
from ..models.mesh_include import MeshInclude
from ..models.mesh_quality import MeshQuality
from ..models.orientation_choice import OrientationChoice
from ..models.solver_choice import SolverChoice
from ..models.surface_choice import SurfaceChoice
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.cloud_ref import CloudRef
    from ..models.hyperparameters import Hyperparameters
    from ..models.kernel import Kernel
    from ..models.mesh_bounds import MeshBounds


T = TypeVar("T", bound="LevelSetRequest")


@_attrs_define
class LevelSetRequest:
    """A cloud in the plane or in space whose surface is to be meshed, or values whose level is.

    Attributes:
        cloud (CloudRef): A cloud, given by the id of a registered cloud or by its points. Exactly one of `id` and
            `points` is
            given.
        kernel (Kernel | Unset): A kernel `k(x, y) = variance · φ(r²)`.

            Here `r = |x − y|/length_scale`, or `r² = Σ (x_c − y_c)²/length_scales_c²`. A parameter of another family
            is refused.
        alpha (float | Unset): Added to the diagonal of the Gram matrix as given, unit of the values squared.

            0 interpolates, and the variance of the noise regresses. Default: 1e-10 if a kernel is given.
            Without a kernel, alpha is chosen. For values it is their noise by the likelihood. For
            surfaces it follows the noise of the points and is at least 1e-3.
        noise_variances (list[float] | Unset): The variance of the noise at each point, instead of `alpha`. An empty
            list counts as absent.
        solver (SolverChoice | Unset): The method that solves the linear system.
        tolerance (float | Unset): The largest relative residual of an answer of the solver `iterative`. Default: 1e-8.
            Beyond the dense limit, `auto` takes that solver for values if this field is given and few
            landmarks are not enough.
        duplicates (DuplicatePolicy | Unset): The treatment of points that coincide when alpha is 0.
        values (list[float] | Unset): A number for each point of the cloud. If given, a level of the function through
            them is meshed.

            Default: the surface that the cloud samples is meshed.
        mean (MeanChoice | Unset): The mean of a function: its part beside the kernel, which it tends to far from the
            points.
        level (float | Unset): The level of the function through `values`. Default: the median of the values.
        surface (SurfaceChoice | Unset): The function whose level set is the surface.
        orientation (OrientationChoice | Unset): The direction of normals.
        step (float | Unset): The longest edge of the lattice that follows the surface. Default: the median spacing of
            the
            points.
        bounds (MeshBounds | Unset): A box that a surface is followed in.
        quality (MeshQuality | Unset): Shape of the triangles.
        open_ (bool | Unset): True if the surface ends where its points end. Default: false. A closed mesh bridges
            holes.
        include (list[MeshInclude] | Unset): Optional parts of the answer. Default: none.
        hyperparameters (Hyperparameters | Unset): What local regressions learned of a cloud.

            Sent as `hyperparameters` of a request about a part of the cloud, they are used as they are.
    """

    cloud: CloudRef
    kernel: Kernel | Unset = UNSET
    alpha: float | Unset = UNSET
    noise_variances: list[float] | Unset = UNSET
    solver: SolverChoice | Unset = UNSET
    tolerance: float | Unset = UNSET
    duplicates: DuplicatePolicy | Unset = UNSET
    values: list[float] | Unset = UNSET
    mean: MeanChoice | Unset = UNSET
    level: float | Unset = UNSET
    surface: SurfaceChoice | Unset = UNSET
    orientation: OrientationChoice | Unset = UNSET
    step: float | Unset = UNSET
    bounds: MeshBounds | Unset = UNSET
    quality: MeshQuality | Unset = UNSET
    open_: bool | Unset = UNSET
    include: list[MeshInclude] | Unset = UNSET
    hyperparameters: Hyperparameters | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        cloud = self.cloud.to_dict()

        kernel: dict[str, Any] | Unset = UNSET
        if not isinstance(self.kernel, Unset):
            kernel = self.kernel.to_dict()

        alpha = self.alpha

        noise_variances: list[float] | Unset = UNSET
        if not isinstance(self.noise_variances, Unset):
            noise_variances = self.noise_variances

        solver: str | Unset = UNSET
        if not isinstance(self.solver, Unset):
            solver = self.solver.value

        tolerance = self.tolerance

        duplicates: str | Unset = UNSET
        if not isinstance(self.duplicates, Unset):
            duplicates = self.duplicates.value

        values: list[float] | Unset = UNSET
        if not isinstance(self.values, Unset):
            values = self.values

        mean: str | Unset = UNSET
        if not isinstance(self.mean, Unset):
            mean = self.mean.value

        level = self.level

        surface: str | Unset = UNSET
        if not isinstance(self.surface, Unset):
            surface = self.surface.value

        orientation: str | Unset = UNSET
        if not isinstance(self.orientation, Unset):
            orientation = self.orientation.value

        step = self.step

        bounds: dict[str, Any] | Unset = UNSET
        if not isinstance(self.bounds, Unset):
            bounds = self.bounds.to_dict()

        quality: str | Unset = UNSET
        if not isinstance(self.quality, Unset):
            quality = self.quality.value

        open_ = self.open_

        include: list[str] | Unset = UNSET
        if not isinstance(self.include, Unset):
            include = []
            for include_item_data in self.include:
                include_item = include_item_data.value
                include.append(include_item)

        hyperparameters: dict[str, Any] | Unset = UNSET
        if not isinstance(self.hyperparameters, Unset):
            hyperparameters = self.hyperparameters.to_dict()

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "cloud": cloud,
            }
        )
        if kernel is not UNSET:
            field_dict["kernel"] = kernel
        if alpha is not UNSET:
            field_dict["alpha"] = alpha
        if noise_variances is not UNSET:
            field_dict["noise_variances"] = noise_variances
        if solver is not UNSET:
            field_dict["solver"] = solver
        if tolerance is not UNSET:
            field_dict["tolerance"] = tolerance
        if duplicates is not UNSET:
            field_dict["duplicates"] = duplicates
        if values is not UNSET:
            field_dict["values"] = values
        if mean is not UNSET:
            field_dict["mean"] = mean
        if level is not UNSET:
            field_dict["level"] = level
        if surface is not UNSET:
            field_dict["surface"] = surface
        if orientation is not UNSET:
            field_dict["orientation"] = orientation
        if step is not UNSET:
            field_dict["step"] = step
        if bounds is not UNSET:
            field_dict["bounds"] = bounds
        if quality is not UNSET:
            field_dict["quality"] = quality
        if open_ is not UNSET:
            field_dict["open"] = open_
        if include is not UNSET:
            field_dict["include"] = include
        if hyperparameters is not UNSET:
            field_dict["hyperparameters"] = hyperparameters

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.cloud_ref import CloudRef
        from ..models.hyperparameters import Hyperparameters
        from ..models.kernel import Kernel
        from ..models.mesh_bounds import MeshBounds

        d = dict(src_dict)
        cloud = CloudRef.from_dict(d.pop("cloud"))

        _kernel = d.pop("kernel", UNSET)
        kernel: Kernel | Unset
        if isinstance(_kernel, Unset):
            kernel = UNSET
        else:
            kernel = Kernel.from_dict(_kernel)

        alpha = d.pop("alpha", UNSET)

        noise_variances = cast(list[float], d.pop("noise_variances", UNSET))

        _solver = d.pop("solver", UNSET)
        solver: SolverChoice | Unset
        if isinstance(_solver, Unset):
            solver = UNSET
        else:
            solver = SolverChoice(_solver)

        tolerance = d.pop("tolerance", UNSET)

        _duplicates = d.pop("duplicates", UNSET)
        duplicates: DuplicatePolicy | Unset
        if isinstance(_duplicates, Unset):
            duplicates = UNSET
        else:
            duplicates = DuplicatePolicy(_duplicates)

        values = cast(list[float], d.pop("values", UNSET))

        _mean = d.pop("mean", UNSET)
        mean: MeanChoice | Unset
        if isinstance(_mean, Unset):
            mean = UNSET
        else:
            mean = MeanChoice(_mean)

        level = d.pop("level", UNSET)

        _surface = d.pop("surface", UNSET)
        surface: SurfaceChoice | Unset
        if isinstance(_surface, Unset):
            surface = UNSET
        else:
            surface = SurfaceChoice(_surface)

        _orientation = d.pop("orientation", UNSET)
        orientation: OrientationChoice | Unset
        if isinstance(_orientation, Unset):
            orientation = UNSET
        else:
            orientation = OrientationChoice(_orientation)

        step = d.pop("step", UNSET)

        _bounds = d.pop("bounds", UNSET)
        bounds: MeshBounds | Unset
        if isinstance(_bounds, Unset):
            bounds = UNSET
        else:
            bounds = MeshBounds.from_dict(_bounds)

        _quality = d.pop("quality", UNSET)
        quality: MeshQuality | Unset
        if isinstance(_quality, Unset):
            quality = UNSET
        else:
            quality = MeshQuality(_quality)

        open_ = d.pop("open", UNSET)

        _include = d.pop("include", UNSET)
        include: list[MeshInclude] | Unset = UNSET
        if _include is not UNSET:
            include = []
            for include_item_data in _include:
                include_item = MeshInclude(include_item_data)

                include.append(include_item)

        _hyperparameters = d.pop("hyperparameters", UNSET)
        hyperparameters: Hyperparameters | Unset
        if isinstance(_hyperparameters, Unset):
            hyperparameters = UNSET
        else:
            hyperparameters = Hyperparameters.from_dict(_hyperparameters)

        level_set_request = cls(
            cloud=cloud,
            kernel=kernel,
            alpha=alpha,
            noise_variances=noise_variances,
            solver=solver,
            tolerance=tolerance,
            duplicates=duplicates,
            values=values,
            mean=mean,
            level=level,
            surface=surface,
            orientation=orientation,
            step=step,
            bounds=bounds,
            quality=quality,
            open_=open_,
            include=include,
            hyperparameters=hyperparameters,
        )

        return level_set_request
