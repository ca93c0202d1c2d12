from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

T = TypeVar("T", bound="KernelParameter")


@_attrs_define
class KernelParameter:
    """A parameter of a kernel family beside `length_scale` and `variance`.

    Attributes:
        name (str): The name of the parameter in a kernel object.
        default (float): The default.
        range_ (str): The values that the parameter may take.
    """

    name: str
    default: float
    range_: str
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        name = self.name

        default = self.default

        range_ = self.range_

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "name": name,
                "default": default,
                "range": range_,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        name = d.pop("name")

        default = d.pop("default")

        range_ = d.pop("range")

        kernel_parameter = cls(
            name=name,
            default=default,
            range_=range_,
        )

        kernel_parameter.additional_properties = d
        return kernel_parameter

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
