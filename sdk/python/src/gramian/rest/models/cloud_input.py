from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="CloudInput")


@_attrs_define
class CloudInput:
    """A cloud, given by the id of a registered cloud or by its points. Exactly one of `id` and `points` is
    given.

        Attributes:
            id (str | Unset): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and the normals if given.
            points (list[list[float]] | Unset): The points, with a row of coordinates each, all of the same length. The
                cloud is registered with the
                request.
            normals (list[list[float]] | Unset): Normals at the points, a row each, of any length but 0, with `points` only.
                They point to the outward
                side. An empty list counts as absent.
    """

    id: str | Unset = UNSET
    points: list[list[float]] | Unset = UNSET
    normals: list[list[float]] | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        id = self.id

        points: list[list[float]] | Unset = UNSET
        if not isinstance(self.points, Unset):
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

        field_dict.update({})
        if id is not UNSET:
            field_dict["id"] = id
        if points is not UNSET:
            field_dict["points"] = points
        if normals is not UNSET:
            field_dict["normals"] = normals

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        id = d.pop("id", UNSET)

        _points = d.pop("points", UNSET)
        points: list[list[float]] | Unset = UNSET
        if _points is not UNSET:
            points = []
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

        cloud_input = cls(
            id=id,
            points=points,
            normals=normals,
        )

        return cloud_input
