from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..models.solver_choice import SolverChoice
from ..models.surface_model_choice import SurfaceModelChoice
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.cloud_input import CloudInput
    from ..models.kernel import Kernel


T = TypeVar("T", bound="Surface")


@_attrs_define
class Surface:
    """The surface of an operator, if it differs from the surface of the request.

    It may come from another cloud, kernel or alpha than the values. Absent fields are taken from the request.

        Attributes:
            cloud (CloudInput | Unset): A cloud, given by the id of a registered cloud or by its points. Exactly one of `id`
                and `points` is
                given.
            kernel (Kernel | Unset): A kernel `k(x, y) = variance · φ(r²)`.

                Here `r = |x − y|/length_scale`, or `r² = Σ (x_c − y_c)²/length_scales_c²`. A parameter of another family
                is refused.
            alpha (float | Unset): Added to the diagonal of the Gram matrix of the surface.
            noise_variances (list[float] | Unset): Noise variances of the surface, an entry per point of its cloud, instead
                of `alpha`. An empty list
                counts as absent.
            solver (SolverChoice | Unset): The method that solves the linear system.
            model (SurfaceModelChoice | Unset): The function whose level set is the surface.
    """

    cloud: CloudInput | Unset = UNSET
    kernel: Kernel | Unset = UNSET
    alpha: float | Unset = UNSET
    noise_variances: list[float] | Unset = UNSET
    solver: SolverChoice | Unset = UNSET
    model: SurfaceModelChoice | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        cloud: dict[str, Any] | Unset = UNSET
        if not isinstance(self.cloud, Unset):
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

        model: str | Unset = UNSET
        if not isinstance(self.model, Unset):
            model = self.model.value

        field_dict: dict[str, Any] = {}

        field_dict.update({})
        if cloud is not UNSET:
            field_dict["cloud"] = cloud
        if kernel is not UNSET:
            field_dict["kernel"] = kernel
        if alpha is not UNSET:
            field_dict["alpha"] = alpha
        if noise_variances is not UNSET:
            field_dict["noise_variances"] = noise_variances
        if solver is not UNSET:
            field_dict["solver"] = solver
        if model is not UNSET:
            field_dict["model"] = model

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.cloud_input import CloudInput
        from ..models.kernel import Kernel

        d = dict(src_dict)
        _cloud = d.pop("cloud", UNSET)
        cloud: CloudInput | Unset
        if isinstance(_cloud, Unset):
            cloud = UNSET
        else:
            cloud = CloudInput.from_dict(_cloud)

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

        _model = d.pop("model", UNSET)
        model: SurfaceModelChoice | Unset
        if isinstance(_model, Unset):
            model = UNSET
        else:
            model = SurfaceModelChoice(_model)

        surface = cls(
            cloud=cloud,
            kernel=kernel,
            alpha=alpha,
            noise_variances=noise_variances,
            solver=solver,
            model=model,
        )

        return surface
