from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="CloudRequest")


@_attrs_define
class CloudRequest:
    """Points to register.

    Attributes:
        points (list[list[float]]): The points, one row of coordinates each. All rows have the same length.
        normals (list[list[float]] | Unset): Normals at the points, one row each.

            They may have any length but 0. The side they point to is outward. An empty list counts as absent.
    """

    points: list[list[float]]
    normals: list[list[float]] | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        points = []
        for points_item_data in self.points:
            points_item = points_item_data

            points.append(points_item)

        normals: list[list[float]] | Unset = UNSET
        if not isinstance(self.normals, Unset):
            normals = []
            for normals_item_data in self.normals:
                normals_item = normals_item_data

                normals.append(normals_item)

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "points": points,
            }
        )
        if normals is not UNSET:
            field_dict["normals"] = normals

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        points = []
        _points = d.pop("points")
        for points_item_data in _points:
            points_item = cast(list[float], points_item_data)

            points.append(points_item)

        _normals = d.pop("normals", UNSET)
        normals: list[list[float]] | Unset = UNSET
        if _normals is not UNSET:
            normals = []
            for normals_item_data in _normals:
                normals_item = cast(list[float], normals_item_data)

                normals.append(normals_item)

        cloud_request = cls(
            points=points,
            normals=normals,
        )

        return cloud_request
