from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.kernel_family import KernelFamily
from ..models.smoothness import Smoothness
from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="KernelUsed")


@_attrs_define
class KernelUsed:
    """The kernel that was used, with every number. Sent back as `kernel`, it gives the same answer.

    Attributes:
        family (KernelFamily): The families of kernels. `GET /v1/kernels` has their formulas.
        variance (float): The factor of φ, unit of the values squared.
        length_scale (float | Unset): The length scale ℓ, in the unit of the coordinates. Absent if each axis has its
            own.
        length_scales (list[float] | Unset): The length scale of each axis, if each has its own.
        epsilon (float | Unset): laplace: φ = exp(−√(r² + epsilon)).
        nu (float | Unset): matern: the smoothness ν.
        smoothness (Smoothness | Unset): How often a Wendland kernel is continuously differentiable.
    """

    family: KernelFamily
    variance: float
    length_scale: float | Unset = UNSET
    length_scales: list[float] | Unset = UNSET
    epsilon: float | Unset = UNSET
    nu: float | Unset = UNSET
    smoothness: Smoothness | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        family = self.family.value

        variance = self.variance

        length_scale = self.length_scale

        length_scales: list[float] | Unset = UNSET
        if not isinstance(self.length_scales, Unset):
            length_scales = self.length_scales

        epsilon = self.epsilon

        nu = self.nu

        smoothness: int | Unset = UNSET
        if not isinstance(self.smoothness, Unset):
            smoothness = self.smoothness.value

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "family": family,
                "variance": variance,
            }
        )
        if length_scale is not UNSET:
            field_dict["length_scale"] = length_scale
        if length_scales is not UNSET:
            field_dict["length_scales"] = length_scales
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

        variance = d.pop("variance")

        length_scale = d.pop("length_scale", UNSET)

        length_scales = cast(list[float], d.pop("length_scales", UNSET))

        epsilon = d.pop("epsilon", UNSET)

        nu = d.pop("nu", UNSET)

        _smoothness = d.pop("smoothness", UNSET)
        smoothness: Smoothness | Unset
        if isinstance(_smoothness, Unset):
            smoothness = UNSET
        else:
            smoothness = Smoothness(_smoothness)

        kernel_used = cls(
            family=family,
            variance=variance,
            length_scale=length_scale,
            length_scales=length_scales,
            epsilon=epsilon,
            nu=nu,
            smoothness=smoothness,
        )

        kernel_used.additional_properties = d
        return kernel_used

    @property
    def additional_keys(self) -> list[str]:
        return list(self.additional_properties.keys())

    def __getitem__(self, key: str) -> Any:
        return self.additional_properties[key]

    def __setitem__(self, key: str, value: Any) -> None:
        self.additional_properties[key] = value

    def __delitem__(self, key: str) -> None:
        del self.additional_properties[key]

    def __contains__(self, key: str) -> bool:
        return key in self.additional_properties
