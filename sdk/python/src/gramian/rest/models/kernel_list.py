from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

if TYPE_CHECKING:
    from ..models.kernel_description import KernelDescription


T = TypeVar("T", bound="KernelList")


@_attrs_define
class KernelList:
    """All kernel families.

    Attributes:
        kernels (list[KernelDescription]): All families.
    """

    kernels: list[KernelDescription]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        kernels = []
        for kernels_item_data in self.kernels:
            kernels_item = kernels_item_data.to_dict()
            kernels.append(kernels_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "kernels": kernels,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.kernel_description import KernelDescription

        d = dict(src_dict)
        kernels = []
        _kernels = d.pop("kernels")
        for kernels_item_data in _kernels:
            kernels_item = KernelDescription.from_dict(kernels_item_data)

            kernels.append(kernels_item)

        kernel_list = cls(
            kernels=kernels,
        )

        kernel_list.additional_properties = d
        return kernel_list

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
