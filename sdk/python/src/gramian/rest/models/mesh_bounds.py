from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..types import without_unset

T = TypeVar("T", bound="MeshBounds")


@_attrs_define
class MeshBounds:
    """A box that a surface is followed in.

    Attributes:
        min_ (list[float]): The least coordinate along each axis.
        max_ (list[float]): The greatest coordinate along each axis.
    """

    min_: list[float]
    max_: list[float]

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        min_ = self.min_

        max_ = self.max_

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "min": min_,
                "max": max_,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        min_ = cast(list[float], d.pop("min"))

        max_ = cast(list[float], d.pop("max"))

        mesh_bounds = cls(
            min_=min_,
            max_=max_,
        )

        return mesh_bounds
