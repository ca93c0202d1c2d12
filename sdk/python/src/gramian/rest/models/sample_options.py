from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define

from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="SampleOptions")


@_attrs_define
class SampleOptions:
    """Functions to draw from the posterior: their number and a seed.

    Attributes:
        count (int): Number of functions to draw.
        seed (int | Unset): The seed of the draws. Default: 0.

            Equal seeds give equal draws on processors of one kind. A larger `count` begins with the draws of a
            smaller one.
    """

    count: int
    seed: int | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        count = self.count

        seed = self.seed

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "count": count,
            }
        )
        if seed is not UNSET:
            field_dict["seed"] = seed

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        count = d.pop("count")

        seed = d.pop("seed", UNSET)

        sample_options = cls(
            count=count,
            seed=seed,
        )

        return sample_options
