from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..models.kernel_family import KernelFamily
from ..models.smoothness import Smoothness
from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="Kernel")


@_attrs_define
class Kernel:
    """A kernel `k(x, y) = variance · φ(r²)`.

    Here `r = |x − y|/length_scale`, or `r² = Σ (x_c − y_c)²/length_scales_c²`. A parameter of another family
    is refused.

        Attributes:
            family (KernelFamily): The families of kernels. `GET /v1/kernels` has their formulas.
            length_scale (float | Unset): The length scale ℓ, in the unit of the coordinates. Default: chosen from the
                cloud.
            length_scales (list[float] | Unset): A length scale per axis, in the units of the coordinates, instead of
                `length_scale`. An empty list
                counts as absent.
            variance (float | Unset): The factor of φ, unit of the values squared. Default: 1.
            epsilon (float | Unset): laplace: φ = exp(−√(r² + epsilon)). Default: 0, which leaves a kink at the points of
                the cloud.
            nu (float | Unset): matern: the smoothness ν, one of 0.5, 1.5, …, 8.5. Default: 2.5.

                The schema gives a range, because generators do not support enumerations of fractions.
            smoothness (Smoothness | Unset): How often a Wendland kernel is continuously differentiable.
    """

    family: KernelFamily
    length_scale: float | Unset = UNSET
    length_scales: list[float] | Unset = UNSET
    variance: float | Unset = UNSET
    epsilon: float | Unset = UNSET
    nu: float | Unset = UNSET
    smoothness: Smoothness | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        family = self.family.value

        length_scale = self.length_scale

        length_scales: list[float] | Unset = UNSET
        if not isinstance(self.length_scales, Unset):
            length_scales = self.length_scales

        variance = self.variance

        epsilon = self.epsilon

        nu = self.nu

        smoothness: int | Unset = UNSET
        if not isinstance(self.smoothness, Unset):
            smoothness = self.smoothness.value

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "family": family,
            }
        )
        if length_scale is not UNSET:
            field_dict["length_scale"] = length_scale
        if length_scales is not UNSET:
            field_dict["length_scales"] = length_scales
        if variance is not UNSET:
            field_dict["variance"] = variance
        if epsilon is not UNSET:
            field_dict["epsilon"] = epsilon
        if nu is not UNSET:
            field_dict["nu"] = nu
        if smoothness is not UNSET:
            field_dict["smoothness"] = smoothness

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        family = KernelFamily(d.pop("family"))

        length_scale = d.pop("length_scale", UNSET)

        length_scales = cast(list[float], d.pop("length_scales", UNSET))

        variance = d.pop("variance", UNSET)

        epsilon = d.pop("epsilon", UNSET)

        nu = d.pop("nu", UNSET)

        _smoothness = d.pop("smoothness", UNSET)
        smoothness: Smoothness | Unset
        if isinstance(_smoothness, Unset):
            smoothness = UNSET
        else:
            smoothness = Smoothness(_smoothness)

        kernel = cls(
            family=family,
            length_scale=length_scale,
            length_scales=length_scales,
            variance=variance,
            epsilon=epsilon,
            nu=nu,
            smoothness=smoothness,
        )

        return kernel
