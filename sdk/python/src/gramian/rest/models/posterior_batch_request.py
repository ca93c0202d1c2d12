from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..models.duplicate_policy import DuplicatePolicy
from ..models.mean_choice import MeanChoice
from ..models.posterior_quantity import PosteriorQuantity
from ..models.solver_choice import SolverChoice
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.cloud_ref import CloudRef
    from ..models.kernel import Kernel
    from ..models.samples import Samples


T = TypeVar("T", bound="PosteriorBatchRequest")


@_attrs_define
class PosteriorBatchRequest:
    """Many lists of noisy values at the points of a cloud, and where their posteriors are wanted.

    Attributes:
        cloud (CloudRef): A cloud: the id of a registered one, or its points. Exactly one of `id` and `points` is given.
        values (list[list[float]]): Lists of observed values, one per point each, in their order. They have kernel and
            noise in common.
        kernel (Kernel | Unset): A kernel `k(x, y) = variance · φ(r²)` with `r = |x − y|/length_scale`, or `r² = Σ (x_c
            − y_c)²/length_scales_c²`. A parameter of another family
            is refused.
        alpha (float | Unset): Added to the diagonal of the Gram matrix as given, unit of the values squared: 0
            interpolates, the variance
            of the noise regresses. Absent: 1e-10 with a kernel given; without one, the noise of the values by their
            likelihood, or
            chosen by the noise of the points of a surface, 1e-3 at least.
        noise_variances (list[float] | Unset): The variance of the noise at each point, instead of `alpha`. An empty
            list counts as absent.
        solver (SolverChoice | Unset): How the linear system is solved.
        duplicates (DuplicatePolicy | Unset): What to do with points that coincide when alpha is 0.
        mean (MeanChoice | Unset): The mean of a function: what it is made of beside the kernel, and tends to far from
            the points.
        queries (list[list[float]] | Unset): Where answers are wanted; the points of the cloud if absent.
        include (list[PosteriorQuantity] | Unset): What is wanted beside the means; nothing if absent.
        samples (Samples | Unset): How many functions to draw from the posterior, and which.
        quantiles (list[float] | Unset): Probabilities between 0 and 1 of which the quantiles of the latent functions
            are wanted; none if absent. An empty list counts as absent.
        threshold (float | Unset): What a new observation is to exceed, unit of the values, for
            `exceedance_probabilities`.
    """

    cloud: CloudRef
    values: list[list[float]]
    kernel: Kernel | Unset = UNSET
    alpha: float | Unset = UNSET
    noise_variances: list[float] | Unset = UNSET
    solver: SolverChoice | Unset = UNSET
    duplicates: DuplicatePolicy | Unset = UNSET
    mean: MeanChoice | Unset = UNSET
    queries: list[list[float]] | Unset = UNSET
    include: list[PosteriorQuantity] | Unset = UNSET
    samples: Samples | Unset = UNSET
    quantiles: list[float] | Unset = UNSET
    threshold: float | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        cloud = self.cloud.to_dict()

        values = []
        for values_item_data in self.values:
            values_item = values_item_data

            values.append(values_item)

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

        include: list[str] | Unset = UNSET
        if not isinstance(self.include, Unset):
            include = []
            for include_item_data in self.include:
                include_item = include_item_data.value
                include.append(include_item)

        samples: dict[str, Any] | Unset = UNSET
        if not isinstance(self.samples, Unset):
            samples = self.samples.to_dict()

        quantiles: list[float] | Unset = UNSET
        if not isinstance(self.quantiles, Unset):
            quantiles = self.quantiles

        threshold = self.threshold

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
        if duplicates is not UNSET:
            field_dict["duplicates"] = duplicates
        if mean is not UNSET:
            field_dict["mean"] = mean
        if queries is not UNSET:
            field_dict["queries"] = queries
        if include is not UNSET:
            field_dict["include"] = include
        if samples is not UNSET:
            field_dict["samples"] = samples
        if quantiles is not UNSET:
            field_dict["quantiles"] = quantiles
        if threshold is not UNSET:
            field_dict["threshold"] = threshold

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.cloud_ref import CloudRef
        from ..models.kernel import Kernel
        from ..models.samples import Samples

        d = dict(src_dict)
        cloud = CloudRef.from_dict(d.pop("cloud"))

        values = []
        _values = d.pop("values")
        for values_item_data in _values:
            values_item = cast(list[float], values_item_data)

            values.append(values_item)

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

        _include = d.pop("include", UNSET)
        include: list[PosteriorQuantity] | Unset = UNSET
        if _include is not UNSET:
            include = []
            for include_item_data in _include:
                include_item = PosteriorQuantity(include_item_data)

                include.append(include_item)

        _samples = d.pop("samples", UNSET)
        samples: Samples | Unset
        if isinstance(_samples, Unset):
            samples = UNSET
        else:
            samples = Samples.from_dict(_samples)

        quantiles = cast(list[float], d.pop("quantiles", UNSET))

        threshold = d.pop("threshold", UNSET)

        posterior_batch_request = cls(
            cloud=cloud,
            values=values,
            kernel=kernel,
            alpha=alpha,
            noise_variances=noise_variances,
            solver=solver,
            duplicates=duplicates,
            mean=mean,
            queries=queries,
            include=include,
            samples=samples,
            quantiles=quantiles,
            threshold=threshold,
        )

        return posterior_batch_request
