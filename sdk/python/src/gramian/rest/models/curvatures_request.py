from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..models.duplicate_policy import DuplicatePolicy
from ..models.geometry_include import GeometryInclude
from ..models.orientation_choice import OrientationChoice
from ..models.solver_choice import SolverChoice
from ..models.surface_choice import SurfaceChoice
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.cloud_ref import CloudRef
    from ..models.hyperparameters import Hyperparameters
    from ..models.kernel import Kernel


T = TypeVar("T", bound="CurvaturesRequest")


@_attrs_define
class CurvaturesRequest:
    """A cloud that samples a hypersurface, and queries at which to compute its curvatures.

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
        queries (list[list[float]] | Unset): The points to compute at, one row of coordinates each. Default: the points
            of the cloud.
        surface (SurfaceChoice | Unset): The function whose level set is the surface.
        orientation (OrientationChoice | Unset): The direction of normals.
        include (list[GeometryInclude] | Unset): Optional parts of the answer. Default: none.
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
    queries: list[list[float]] | Unset = UNSET
    surface: SurfaceChoice | Unset = UNSET
    orientation: OrientationChoice | Unset = UNSET
    include: list[GeometryInclude] | Unset = UNSET
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

        queries: list[list[float]] | Unset = UNSET
        if not isinstance(self.queries, Unset):
            queries = []
            for queries_item_data in self.queries:
                queries_item = queries_item_data

                queries.append(queries_item)

        surface: str | Unset = UNSET
        if not isinstance(self.surface, Unset):
            surface = self.surface.value

        orientation: str | Unset = UNSET
        if not isinstance(self.orientation, Unset):
            orientation = self.orientation.value

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
        if queries is not UNSET:
            field_dict["queries"] = queries
        if surface is not UNSET:
            field_dict["surface"] = surface
        if orientation is not UNSET:
            field_dict["orientation"] = orientation
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

        _queries = d.pop("queries", UNSET)
        queries: list[list[float]] | Unset = UNSET
        if _queries is not UNSET:
            queries = []
            for queries_item_data in _queries:
                queries_item = cast(list[float], queries_item_data)

                queries.append(queries_item)

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

        _include = d.pop("include", UNSET)
        include: list[GeometryInclude] | Unset = UNSET
        if _include is not UNSET:
            include = []
            for include_item_data in _include:
                include_item = GeometryInclude(include_item_data)

                include.append(include_item)

        _hyperparameters = d.pop("hyperparameters", UNSET)
        hyperparameters: Hyperparameters | Unset
        if isinstance(_hyperparameters, Unset):
            hyperparameters = UNSET
        else:
            hyperparameters = Hyperparameters.from_dict(_hyperparameters)

        curvatures_request = cls(
            cloud=cloud,
            kernel=kernel,
            alpha=alpha,
            noise_variances=noise_variances,
            solver=solver,
            tolerance=tolerance,
            duplicates=duplicates,
            queries=queries,
            surface=surface,
            orientation=orientation,
            include=include,
            hyperparameters=hyperparameters,
        )

        return curvatures_request
