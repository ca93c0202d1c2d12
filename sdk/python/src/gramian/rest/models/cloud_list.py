from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.cloud import Cloud


T = TypeVar("T", bound="CloudList")


@_attrs_define
class CloudList:
    """A page of clouds, oldest first.

    Attributes:
        clouds (list[Cloud]): The clouds of this page.
        next_ (str | Unset): Where a page of clouds ends, for the next one. What it is made of may change.
    """

    clouds: list[Cloud]
    next_: str | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        clouds = []
        for clouds_item_data in self.clouds:
            clouds_item = clouds_item_data.to_dict()
            clouds.append(clouds_item)

        next_ = self.next_

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "clouds": clouds,
            }
        )
        if next_ is not UNSET:
            field_dict["next"] = next_

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.cloud import Cloud

        d = dict(src_dict)
        clouds = []
        _clouds = d.pop("clouds")
        for clouds_item_data in _clouds:
            clouds_item = Cloud.from_dict(clouds_item_data)

            clouds.append(clouds_item)

        next_ = d.pop("next", UNSET)

        cloud_list = cls(
            clouds=clouds,
            next_=next_,
        )

        cloud_list.additional_properties = d
        return cloud_list

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
