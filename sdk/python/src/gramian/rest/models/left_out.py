from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

T = TypeVar("T", bound="LeftOut")


@_attrs_define
class LeftOut:
    """What each value is predicted to be from all others.

    Attributes:
        means (list[float]): The predictions, in the order of the points.
        variances (list[float]): The variances of the values predicted, their noise included.
        log_predictive_densities (list[float]): The logarithms of the densities of the values under their predictions.
    """

    means: list[float]
    variances: list[float]
    log_predictive_densities: list[float]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        means = self.means

        variances = self.variances

        log_predictive_densities = self.log_predictive_densities

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "means": means,
                "variances": variances,
                "log_predictive_densities": log_predictive_densities,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        means = cast(list[float], d.pop("means"))

        variances = cast(list[float], d.pop("variances"))

        log_predictive_densities = cast(list[float], d.pop("log_predictive_densities"))

        left_out = cls(
            means=means,
            variances=variances,
            log_predictive_densities=log_predictive_densities,
        )

        left_out.additional_properties = d
        return left_out

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
