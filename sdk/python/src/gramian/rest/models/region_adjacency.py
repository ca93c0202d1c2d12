from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define

from ..types import without_unset

T = TypeVar("T", bound="RegionAdjacency")


@_attrs_define
class RegionAdjacency:
    """Weights of the edges between two regions, or within one, by whether normals agree across them.

    Attributes:
        first (int): The position of one of the two regions among those of the tile.
        second (int): The position of the other one.
        agreeing (float): The weight of the edges across which the normals agree.
        opposing (float): The weight of the edges across which the normals are opposite.
    """

    first: int
    second: int
    agreeing: float
    opposing: float

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        first = self.first

        second = self.second

        agreeing = self.agreeing

        opposing = self.opposing

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "first": first,
                "second": second,
                "agreeing": agreeing,
                "opposing": opposing,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        first = d.pop("first")

        second = d.pop("second")

        agreeing = d.pop("agreeing")

        opposing = d.pop("opposing")

        region_adjacency = cls(
            first=first,
            second=second,
            agreeing=agreeing,
            opposing=opposing,
        )

        return region_adjacency
