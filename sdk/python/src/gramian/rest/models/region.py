from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..types import without_unset

T = TypeVar("T", bound="Region")


@_attrs_define
class Region:
    """Neighbouring points of a tile whose normals agree, with sums over those that the tile answers for.

    a is the area that a point x stands for, and ν its normal.

        Attributes:
            n_points (int): Number of points.
            n_signed (int): Number of points where the coarse cloud determines the side.
            n_coarse (int): Number of points of the coarse cloud.
            area (float): The sum of a.
            centre (list[float]): The mean c of x, weighted with a.
            spread (float): The sum of a|x − c|².
            normal (list[float]): The sum of aν.
            volume (float): The sum of a(x − c)·ν.
            lower (list[float]): The lower corner of the box around all points of the region in the tile.
            upper (list[float]): The upper corner of that box.
    """

    n_points: int
    n_signed: int
    n_coarse: int
    area: float
    centre: list[float]
    spread: float
    normal: list[float]
    volume: float
    lower: list[float]
    upper: list[float]

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        n_points = self.n_points

        n_signed = self.n_signed

        n_coarse = self.n_coarse

        area = self.area

        centre = self.centre

        spread = self.spread

        normal = self.normal

        volume = self.volume

        lower = self.lower

        upper = self.upper

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "n_points": n_points,
                "n_signed": n_signed,
                "n_coarse": n_coarse,
                "area": area,
                "centre": centre,
                "spread": spread,
                "normal": normal,
                "volume": volume,
                "lower": lower,
                "upper": upper,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        n_points = d.pop("n_points")

        n_signed = d.pop("n_signed")

        n_coarse = d.pop("n_coarse")

        area = d.pop("area")

        centre = cast(list[float], d.pop("centre"))

        spread = d.pop("spread")

        normal = cast(list[float], d.pop("normal"))

        volume = d.pop("volume")

        lower = cast(list[float], d.pop("lower"))

        upper = cast(list[float], d.pop("upper"))

        region = cls(
            n_points=n_points,
            n_signed=n_signed,
            n_coarse=n_coarse,
            area=area,
            centre=centre,
            spread=spread,
            normal=normal,
            volume=volume,
            lower=lower,
            upper=upper,
        )

        return region
