from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..models.duplicate_policy import DuplicatePolicy
from ..models.mean_choice import MeanChoice
from ..models.solver_choice import SolverChoice
from ..models.values_include import ValuesInclude
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.cloud_ref import CloudRef
    from ..models.geometry import Geometry
    from ..models.hyperparameters import Hyperparameters
    from ..models.kernel import Kernel


T = TypeVar("T", bound="SurfaceGradientRequest")


@_attrs_define
class SurfaceGradientRequest:
    """Values on a surface, and queries at which to compute their surface gradient.

    Attributes:
        cloud (CloudRef): A cloud, given by the id of a registered cloud or by its points. Exactly one of `id` and
            `points` is
            given.
        values (list[float]): The values at the points of `cloud`, in their order.
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
        mean (MeanChoice | Unset): The mean of a function: its part beside the kernel, which it tends to far from the
            points.
        queries (list[list[float]] | Unset): The points to compute at, one row of coordinates each. Default: the points
            of the surface's cloud.
        geometry (Geometry | Unset): The surface of an operator, if it differs from the surface of the request.

            It may come from another cloud, kernel or alpha than the values. Absent fields are taken from the request.
        include (list[ValuesInclude] | Unset): Optional parts of the answer. Default: none.
        hyperparameters (Hyperparameters | Unset): What local regressions learned of a cloud.

            Sent as `hyperparameters` of a request about a part of the cloud, they are used as they are.
    """

    cloud: CloudRef
    values: list[float]
    kernel: Kernel | Unset = UNSET
    alpha: float | Unset = UNSET
    noise_variances: list[float] | Unset = UNSET
    solver: SolverChoice | Unset = UNSET
    tolerance: float | Unset = UNSET
    duplicates: DuplicatePolicy | Unset = UNSET
    mean: MeanChoice | Unset = UNSET
    queries: list[list[float]] | Unset = UNSET
    geometry: Geometry | Unset = UNSET
    include: list[ValuesInclude] | Unset = UNSET
    hyperparameters: Hyperparameters | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        cloud = self.cloud.to_dict()

        values = self.values

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

        mean: str | Unset = UNSET
        if not isinstance(self.mean, Unset):
            mean = self.mean.value

        queries: list[list[float]] | Unset = UNSET
        if not isinstance(self.queries, Unset):
            queries = []
            for queries_item_data in self.queries:
                queries_item = queries_item_data

                queries.append(queries_item)

        geometry: dict[str, Any] | Unset = UNSET
        if not isinstance(self.geometry, Unset):
            geometry = self.geometry.to_dict()

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
                "values": values,
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
        if mean is not UNSET:
            field_dict["mean"] = mean
        if queries is not UNSET:
            field_dict["queries"] = queries
        if geometry is not UNSET:
            field_dict["geometry"] = geometry
        if include is not UNSET:
            field_dict["include"] = include
        if hyperparameters is not UNSET:
            field_dict["hyperparameters"] = hyperparameters

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.cloud_ref import CloudRef
        from ..models.geometry import Geometry
        from ..models.hyperparameters import Hyperparameters
        from ..models.kernel import Kernel

        d = dict(src_dict)
        cloud = CloudRef.from_dict(d.pop("cloud"))

        values = cast(list[float], d.pop("values"))

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

        _mean = d.pop("mean", UNSET)
        mean: MeanChoice | Unset
        if isinstance(_mean, Unset):
            mean = UNSET
        else:
            mean = MeanChoice(_mean)

        _queries = d.pop("queries", UNSET)
        queries: list[list[float]] | Unset = UNSET
        if _queries is not UNSET:
            queries = []
            for queries_item_data in _queries:
                queries_item = cast(list[float], queries_item_data)

                queries.append(queries_item)

        _geometry = d.pop("geometry", UNSET)
        geometry: Geometry | Unset
        if isinstance(_geometry, Unset):
            geometry = UNSET
        else:
            geometry = Geometry.from_dict(_geometry)

        _include = d.pop("include", UNSET)
        include: list[ValuesInclude] | Unset = UNSET
        if _include is not UNSET:
            include = []
            for include_item_data in _include:
                include_item = ValuesInclude(include_item_data)

                include.append(include_item)

        _hyperparameters = d.pop("hyperparameters", UNSET)
        hyperparameters: Hyperparameters | Unset
        if isinstance(_hyperparameters, Unset):
            hyperparameters = UNSET
        else:
            hyperparameters = Hyperparameters.from_dict(_hyperparameters)

        surface_gradient_request = cls(
            cloud=cloud,
            values=values,
            kernel=kernel,
            alpha=alpha,
            noise_variances=noise_variances,
            solver=solver,
            tolerance=tolerance,
            duplicates=duplicates,
            mean=mean,
            queries=queries,
            geometry=geometry,
            include=include,
            hyperparameters=hyperparameters,
        )

        return surface_gradient_request
