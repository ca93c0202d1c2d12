from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.kernel_family import KernelFamily
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.kernel_parameter import KernelParameter


T = TypeVar("T", bound="KernelDescription")


@_attrs_define
class KernelDescription:
    """A family of kernels.

    Attributes:
        family (KernelFamily): The families of kernels. `GET /v1/kernels` has their formulas.
        formula (str): φ as a function of r. The kernel is variance · φ(r).

            r = |x − y|/length_scale, or r² = Σ (x_c − y_c)²/length_scales_c².
        smoothness (str): The smoothness of functions fitted with the kernel.
        parameters (list[KernelParameter]): Parameters beside `length_scale`, or `length_scales`, and `variance`.
        differentiable_at_points (str): The condition under which the kernel has derivatives at the points of the cloud.

            Geometry and operators need derivatives there.
        max_dimension (int | Unset): The largest dimension in which the kernel is positive definite. Absent if there is
            no limit.
    """

    family: KernelFamily
    formula: str
    smoothness: str
    parameters: list[KernelParameter]
    differentiable_at_points: str
    max_dimension: int | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        family = self.family.value

        formula = self.formula

        smoothness = self.smoothness

        parameters = []
        for parameters_item_data in self.parameters:
            parameters_item = parameters_item_data.to_dict()
            parameters.append(parameters_item)

        differentiable_at_points = self.differentiable_at_points

        max_dimension = self.max_dimension

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "family": family,
                "formula": formula,
                "smoothness": smoothness,
                "parameters": parameters,
                "differentiable_at_points": differentiable_at_points,
            }
        )
        if max_dimension is not UNSET:
            field_dict["max_dimension"] = max_dimension

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.kernel_parameter import KernelParameter

        d = dict(src_dict)
        family = KernelFamily(d.pop("family"))

        formula = d.pop("formula")

        smoothness = d.pop("smoothness")

        parameters = []
        _parameters = d.pop("parameters")
        for parameters_item_data in _parameters:
            parameters_item = KernelParameter.from_dict(parameters_item_data)

            parameters.append(parameters_item)

        differentiable_at_points = d.pop("differentiable_at_points")

        max_dimension = d.pop("max_dimension", UNSET)

        kernel_description = cls(
            family=family,
            formula=formula,
            smoothness=smoothness,
            parameters=parameters,
            differentiable_at_points=differentiable_at_points,
            max_dimension=max_dimension,
        )

        kernel_description.additional_properties = d
        return kernel_description

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
