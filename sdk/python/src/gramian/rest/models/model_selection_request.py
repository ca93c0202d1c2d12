from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..models.duplicate_policy import DuplicatePolicy
from ..models.kernel_family import KernelFamily
from ..models.mean_choice import MeanChoice
from ..models.selection_criterion import SelectionCriterion
from ..models.solver_choice import SolverChoice
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.cloud_ref import CloudRef
    from ..models.free_parameter import FreeParameter
    from ..models.kernel import Kernel


T = TypeVar("T", bound="ModelSelectionRequest")


@_attrs_define
class ModelSelectionRequest:
    """Values at the points of a cloud, and the parameters that may vary to explain them.

    The search begins with `kernel` and `alpha`.

        Attributes:
            cloud (CloudRef): A cloud, given by the id of a registered cloud or by its points. Exactly one of `id` and
                `points` is
                given.
            values (list[float]): The values at the points, in their order.
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
            criterion (SelectionCriterion | Unset): The score that a selection maximizes.
            vary (list[FreeParameter] | Unset): The free parameters and their bounds, at most 64 entries. Default: length
                scale, variance, alpha.

                By default, length scale and variance may become up to a hundred times smaller or larger than at
                the start. If `kernel` has a length scale per axis, each of them varies. Alpha varies unless noise
                is given for each point. Its lower bound is a millionth of its start, or of a millionth of the
                variance if that is more. Its upper bound is a hundred times its start, or a hundred times the
                variance if that is more.
            families (list[KernelFamily] | Unset): Kernel families to try. Default: that of the start, and `matern` if `nu`
                varies.

                A family takes the parameters of `kernel` if `kernel` is of that family.
            restarts (int | Unset): Number of further starts for each family, spread over the bounds. Default: 2.
            seed (int | Unset): The seed that determines the further starts. Default: 0.
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
    criterion: SelectionCriterion | Unset = UNSET
    vary: list[FreeParameter] | Unset = UNSET
    families: list[KernelFamily] | Unset = UNSET
    restarts: int | Unset = UNSET
    seed: int | Unset = UNSET

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

        criterion: str | Unset = UNSET
        if not isinstance(self.criterion, Unset):
            criterion = self.criterion.value

        vary: list[dict[str, Any]] | Unset = UNSET
        if not isinstance(self.vary, Unset):
            vary = []
            for vary_item_data in self.vary:
                vary_item = vary_item_data.to_dict()
                vary.append(vary_item)

        families: list[str] | Unset = UNSET
        if not isinstance(self.families, Unset):
            families = []
            for families_item_data in self.families:
                families_item = families_item_data.value
                families.append(families_item)

        restarts = self.restarts

        seed = self.seed

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
        if criterion is not UNSET:
            field_dict["criterion"] = criterion
        if vary is not UNSET:
            field_dict["vary"] = vary
        if families is not UNSET:
            field_dict["families"] = families
        if restarts is not UNSET:
            field_dict["restarts"] = restarts
        if seed is not UNSET:
            field_dict["seed"] = seed

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.cloud_ref import CloudRef
        from ..models.free_parameter import FreeParameter
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

        _criterion = d.pop("criterion", UNSET)
        criterion: SelectionCriterion | Unset
        if isinstance(_criterion, Unset):
            criterion = UNSET
        else:
            criterion = SelectionCriterion(_criterion)

        _vary = d.pop("vary", UNSET)
        vary: list[FreeParameter] | Unset = UNSET
        if _vary is not UNSET:
            vary = []
            for vary_item_data in _vary:
                vary_item = FreeParameter.from_dict(vary_item_data)

                vary.append(vary_item)

        _families = d.pop("families", UNSET)
        families: list[KernelFamily] | Unset = UNSET
        if _families is not UNSET:
            families = []
            for families_item_data in _families:
                families_item = KernelFamily(families_item_data)

                families.append(families_item)

        restarts = d.pop("restarts", UNSET)

        seed = d.pop("seed", UNSET)

        model_selection_request = cls(
            cloud=cloud,
            values=values,
            kernel=kernel,
            alpha=alpha,
            noise_variances=noise_variances,
            solver=solver,
            tolerance=tolerance,
            duplicates=duplicates,
            mean=mean,
            criterion=criterion,
            vary=vary,
            families=families,
            restarts=restarts,
            seed=seed,
        )

        return model_selection_request
