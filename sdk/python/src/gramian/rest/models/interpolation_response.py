from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="InterpolationResponse")


@_attrs_define
class InterpolationResponse:
    """The interpolant (regression function, if alpha > 0) at the queries.

    Attributes:
        values (list[float]): u at each query.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
        gradients (list[list[float]] | Unset): ∇u at each query, unit of the values per length. Present if `derivatives`
            is 1 or 2.
        hessians (list[list[list[float]]] | Unset): D²u at each query, unit of the values per length squared. Present if
            `derivatives` is 2.
        value_deviations (list[float] | Unset): Standard deviation of u at each query, given the values. Present if
            `include` has `deviations`.

            The kernel is taken as covariance, and alpha as variance of the noise.
        gradient_deviations (list[list[float]] | Unset): Standard deviation of each component of ∇u at each query.

            Present if `include` has `deviations` and `derivatives` is 1 or 2.
        hessian_deviations (list[list[list[float]]] | Unset): Standard deviation of each entry of D²u at each query.

            Present if `include` has `deviations` and `derivatives` is 2.
    """

    values: list[float]
    diagnostics: Diagnostics
    gradients: list[list[float]] | Unset = UNSET
    hessians: list[list[list[float]]] | Unset = UNSET
    value_deviations: list[float] | Unset = UNSET
    gradient_deviations: list[list[float]] | Unset = UNSET
    hessian_deviations: list[list[list[float]]] | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        values = self.values

        diagnostics = self.diagnostics.to_dict()

        gradients: list[list[float]] | Unset = UNSET
        if not isinstance(self.gradients, Unset):
            gradients = []
            for gradients_item_data in self.gradients:
                gradients_item = gradients_item_data

                gradients.append(gradients_item)

        hessians: list[list[list[float]]] | Unset = UNSET
        if not isinstance(self.hessians, Unset):
            hessians = []
            for hessians_item_data in self.hessians:
                hessians_item = []
                for hessians_item_item_data in hessians_item_data:
                    hessians_item_item = hessians_item_item_data

                    hessians_item.append(hessians_item_item)

                hessians.append(hessians_item)

        value_deviations: list[float] | Unset = UNSET
        if not isinstance(self.value_deviations, Unset):
            value_deviations = self.value_deviations

        gradient_deviations: list[list[float]] | Unset = UNSET
        if not isinstance(self.gradient_deviations, Unset):
            gradient_deviations = []
            for gradient_deviations_item_data in self.gradient_deviations:
                gradient_deviations_item = gradient_deviations_item_data

                gradient_deviations.append(gradient_deviations_item)

        hessian_deviations: list[list[list[float]]] | Unset = UNSET
        if not isinstance(self.hessian_deviations, Unset):
            hessian_deviations = []
            for hessian_deviations_item_data in self.hessian_deviations:
                hessian_deviations_item = []
                for hessian_deviations_item_item_data in hessian_deviations_item_data:
                    hessian_deviations_item_item = hessian_deviations_item_item_data

                    hessian_deviations_item.append(hessian_deviations_item_item)

                hessian_deviations.append(hessian_deviations_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "values": values,
                "diagnostics": diagnostics,
            }
        )
        if gradients is not UNSET:
            field_dict["gradients"] = gradients
        if hessians is not UNSET:
            field_dict["hessians"] = hessians
        if value_deviations is not UNSET:
            field_dict["value_deviations"] = value_deviations
        if gradient_deviations is not UNSET:
            field_dict["gradient_deviations"] = gradient_deviations
        if hessian_deviations is not UNSET:
            field_dict["hessian_deviations"] = hessian_deviations

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        values = cast(list[float], d.pop("values"))

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        _gradients = d.pop("gradients", UNSET)
        gradients: list[list[float]] | Unset = UNSET
        if _gradients is not UNSET:
            gradients = []
            for gradients_item_data in _gradients:
                gradients_item = cast(list[float], gradients_item_data)

                gradients.append(gradients_item)

        _hessians = d.pop("hessians", UNSET)
        hessians: list[list[list[float]]] | Unset = UNSET
        if _hessians is not UNSET:
            hessians = []
            for hessians_item_data in _hessians:
                hessians_item = []
                _hessians_item = hessians_item_data
                for hessians_item_item_data in _hessians_item:
                    hessians_item_item = cast(list[float], hessians_item_item_data)

                    hessians_item.append(hessians_item_item)

                hessians.append(hessians_item)

        value_deviations = cast(list[float], d.pop("value_deviations", UNSET))

        _gradient_deviations = d.pop("gradient_deviations", UNSET)
        gradient_deviations: list[list[float]] | Unset = UNSET
        if _gradient_deviations is not UNSET:
            gradient_deviations = []
            for gradient_deviations_item_data in _gradient_deviations:
                gradient_deviations_item = cast(list[float], gradient_deviations_item_data)

                gradient_deviations.append(gradient_deviations_item)

        _hessian_deviations = d.pop("hessian_deviations", UNSET)
        hessian_deviations: list[list[list[float]]] | Unset = UNSET
        if _hessian_deviations is not UNSET:
            hessian_deviations = []
            for hessian_deviations_item_data in _hessian_deviations:
                hessian_deviations_item = []
                _hessian_deviations_item = hessian_deviations_item_data
                for hessian_deviations_item_item_data in _hessian_deviations_item:
                    hessian_deviations_item_item = cast(list[float], hessian_deviations_item_item_data)

                    hessian_deviations_item.append(hessian_deviations_item_item)

                hessian_deviations.append(hessian_deviations_item)

        interpolation_response = cls(
            values=values,
            diagnostics=diagnostics,
            gradients=gradients,
            hessians=hessians,
            value_deviations=value_deviations,
            gradient_deviations=gradient_deviations,
            hessian_deviations=hessian_deviations,
        )

        interpolation_response.additional_properties = d
        return interpolation_response

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
