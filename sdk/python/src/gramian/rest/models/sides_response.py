from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

T = TypeVar("T", bound="SidesResponse")


@_attrs_define
class SidesResponse:
    """The sides of regions, in the order of the request.

    Attributes:
        signs (list[int]): 1 or −1 for each region: the sign to multiply its normals with.
        are_doubtful (list[bool]): True for each region whose side is nearly a matter of chance.
    """

    signs: list[int]
    are_doubtful: list[bool]
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        signs = self.signs

        are_doubtful = self.are_doubtful

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "signs": signs,
                "are_doubtful": are_doubtful,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        signs = cast(list[int], d.pop("signs"))

        are_doubtful = cast(list[bool], d.pop("are_doubtful"))

        sides_response = cls(
            signs=signs,
            are_doubtful=are_doubtful,
        )

        sides_response.additional_properties = d
        return sides_response

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
