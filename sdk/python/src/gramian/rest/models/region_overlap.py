from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define

from ..types import without_unset

T = TypeVar("T", bound="RegionOverlap")


@_attrs_define
class RegionOverlap:
    """Two regions that have a point in common.

    Attributes:
        first (int): The position of one of them among the regions of all tiles.
        second (int): The position of the other one.
    """

    first: int
    second: int

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        first = self.first

        second = self.second

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "first": first,
                "second": second,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        first = d.pop("first")

        second = d.pop("second")

        region_overlap = cls(
            first=first,
            second=second,
        )

        return region_overlap
