from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.degenerate import Degenerate
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="SurfaceGradientResponse")


@_attrs_define
class SurfaceGradientResponse:
    """Surface gradients at the queries.

    Attributes:
        gradients (list[list[float] | None]): ∇u − (∇u·ν)ν at each query, unit of the values per length. Null where
            there is no normal.
        degenerate (list[Degenerate]): The queries where geometry has no meaning (null), or less accuracy than it seems.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
        gradient_deviations (list[list[float] | None] | Unset): Standard deviation of each component at each query.
            Present if `include` has `deviations`.

            It comes from noise and gaps of the values and, as far as the surface has deviations, also from
            the surface. Null where there is no answer or no deviation.
    """

    gradients: list[list[float] | None]
    degenerate: list[Degenerate]
    diagnostics: Diagnostics
    gradient_deviations: list[list[float] | None] | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        gradients = []
        for gradients_item_data in self.gradients:
            gradients_item: list[float] | None
            if isinstance(gradients_item_data, list):
                gradients_item = gradients_item_data

            else:
                gradients_item = gradients_item_data
            gradients.append(gradients_item)

        degenerate = []
        for degenerate_item_data in self.degenerate:
            degenerate_item = degenerate_item_data.to_dict()
            degenerate.append(degenerate_item)

        diagnostics = self.diagnostics.to_dict()

        gradient_deviations: list[list[float] | None] | Unset = UNSET
        if not isinstance(self.gradient_deviations, Unset):
            gradient_deviations = []
            for gradient_deviations_item_data in self.gradient_deviations:
                gradient_deviations_item: list[float] | None
                if isinstance(gradient_deviations_item_data, list):
                    gradient_deviations_item = gradient_deviations_item_data

                else:
                    gradient_deviations_item = gradient_deviations_item_data
                gradient_deviations.append(gradient_deviations_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "gradients": gradients,
                "degenerate": degenerate,
                "diagnostics": diagnostics,
            }
        )
        if gradient_deviations is not UNSET:
            field_dict["gradient_deviations"] = gradient_deviations

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.degenerate import Degenerate
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        gradients = []
        _gradients = d.pop("gradients")
        for gradients_item_data in _gradients:

            def _parse_gradients_item(data: object) -> list[float] | None:
                if data is None:
                    return data
                try:
                    if not isinstance(data, list):
                        raise TypeError()
                    gradients_item_type_0 = cast(list[float], data)

                    return gradients_item_type_0
                except (TypeError, ValueError, AttributeError, KeyError):
                    pass
                return cast(list[float] | None, data)

            gradients_item = _parse_gradients_item(gradients_item_data)

            gradients.append(gradients_item)

        degenerate = []
        _degenerate = d.pop("degenerate")
        for degenerate_item_data in _degenerate:
            degenerate_item = Degenerate.from_dict(degenerate_item_data)

            degenerate.append(degenerate_item)

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        _gradient_deviations = d.pop("gradient_deviations", UNSET)
        gradient_deviations: list[list[float] | None] | Unset = UNSET
        if _gradient_deviations is not UNSET:
            gradient_deviations = []
            for gradient_deviations_item_data in _gradient_deviations:

                def _parse_gradient_deviations_item(data: object) -> list[float] | None:
                    if data is None:
                        return data
                    try:
                        if not isinstance(data, list):
                            raise TypeError()
                        gradient_deviations_item_type_0 = cast(list[float], data)

                        return gradient_deviations_item_type_0
                    except (TypeError, ValueError, AttributeError, KeyError):
                        pass
                    return cast(list[float] | None, data)

                gradient_deviations_item = _parse_gradient_deviations_item(gradient_deviations_item_data)

                gradient_deviations.append(gradient_deviations_item)

        surface_gradient_response = cls(
            gradients=gradients,
            degenerate=degenerate,
            diagnostics=diagnostics,
            gradient_deviations=gradient_deviations,
        )

        surface_gradient_response.additional_properties = d
        return surface_gradient_response

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
