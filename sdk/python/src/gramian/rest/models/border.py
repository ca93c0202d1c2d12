from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..types import without_unset

T = TypeVar("T", bound="Border")


@_attrs_define
class Border:
    """What the edges between two regions say, or those within one.

    Attributes:
        regions (list[int]): The positions of the two regions among those of the tile.
        agreeing (float): The weight of the edges across which the normals agree.
        opposing (float): The weight of the edges across which the normals are opposite.
    """

    regions: list[int]
    agreeing: float
    opposing: float

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        regions = self.regions

        agreeing = self.agreeing

        opposing = self.opposing

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "regions": regions,
                "agreeing": agreeing,
                "opposing": opposing,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        regions = cast(list[int], d.pop("regions"))

        agreeing = d.pop("agreeing")

        opposing = d.pop("opposing")

        border = cls(
            regions=regions,
            agreeing=agreeing,
            opposing=opposing,
        )

        return border
