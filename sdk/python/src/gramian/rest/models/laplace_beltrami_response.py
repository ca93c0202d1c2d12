from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.degenerate import Degenerate
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="LaplaceBeltramiResponse")


@_attrs_define
class LaplaceBeltramiResponse:
    """The Laplace–Beltrami operator of the values at the queries.

    Attributes:
        values (list[float | None]): Δu at each query, unit of the values per length squared. Null where there is no
            normal.
        degenerate (list[Degenerate]): The queries where geometry has no meaning (null), or less accuracy than it seems.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
        value_deviations (list[float | None] | Unset): Standard deviation of Δu at each query. Present if `include` has
            `deviations`.

            It comes from noise and gaps of the values and, as far as the surface has deviations, also from
            the surface. Null where there is no answer or no deviation.
    """

    values: list[float | None]
    degenerate: list[Degenerate]
    diagnostics: Diagnostics
    value_deviations: list[float | None] | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        values = []
        for values_item_data in self.values:
            values_item: float | None
            values_item = values_item_data
            values.append(values_item)

        degenerate = []
        for degenerate_item_data in self.degenerate:
            degenerate_item = degenerate_item_data.to_dict()
            degenerate.append(degenerate_item)

        diagnostics = self.diagnostics.to_dict()

        value_deviations: list[float | None] | Unset = UNSET
        if not isinstance(self.value_deviations, Unset):
            value_deviations = []
            for value_deviations_item_data in self.value_deviations:
                value_deviations_item: float | None
                value_deviations_item = value_deviations_item_data
                value_deviations.append(value_deviations_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "values": values,
                "degenerate": degenerate,
                "diagnostics": diagnostics,
            }
        )
        if value_deviations is not UNSET:
            field_dict["value_deviations"] = value_deviations

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.degenerate import Degenerate
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        values = []
        _values = d.pop("values")
        for values_item_data in _values:

            def _parse_values_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            values_item = _parse_values_item(values_item_data)

            values.append(values_item)

        degenerate = []
        _degenerate = d.pop("degenerate")
        for degenerate_item_data in _degenerate:
            degenerate_item = Degenerate.from_dict(degenerate_item_data)

            degenerate.append(degenerate_item)

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        _value_deviations = d.pop("value_deviations", UNSET)
        value_deviations: list[float | None] | Unset = UNSET
        if _value_deviations is not UNSET:
            value_deviations = []
            for value_deviations_item_data in _value_deviations:

                def _parse_value_deviations_item(data: object) -> float | None:
                    if data is None:
                        return data
                    return cast(float | None, data)

                value_deviations_item = _parse_value_deviations_item(value_deviations_item_data)

                value_deviations.append(value_deviations_item)

        laplace_beltrami_response = cls(
            values=values,
            degenerate=degenerate,
            diagnostics=diagnostics,
            value_deviations=value_deviations,
        )

        laplace_beltrami_response.additional_properties = d
        return laplace_beltrami_response

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
