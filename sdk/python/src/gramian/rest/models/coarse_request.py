from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="CoarseRequest")


@_attrs_define
class CoarseRequest:
    """A cloud, and how noisy it is.

    Attributes:
        points (list[list[float]]): The points of the cloud, or some of a large one, chosen evenly.
        count (int | Unset): The number of points to choose. Default: a sixth, at least 600 (or all points) and at most
            6,000.
        noise_deviation (float | Unset): The standard deviation of the noise of the points across the surface. Default:
            0.
    """

    points: list[list[float]]
    count: int | Unset = UNSET
    noise_deviation: float | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        points = []
        for points_item_data in self.points:
            points_item = points_item_data

            points.append(points_item)

        count = self.count

        noise_deviation = self.noise_deviation

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "points": points,
            }
        )
        if count is not UNSET:
            field_dict["count"] = count
        if noise_deviation is not UNSET:
            field_dict["noise_deviation"] = noise_deviation

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        points = []
        _points = d.pop("points")
        for points_item_data in _points:
            points_item = cast(list[float], points_item_data)

            points.append(points_item)

        count = d.pop("count", UNSET)

        noise_deviation = d.pop("noise_deviation", UNSET)

        coarse_request = cls(
            points=points,
            count=count,
            noise_deviation=noise_deviation,
        )

        return coarse_request
