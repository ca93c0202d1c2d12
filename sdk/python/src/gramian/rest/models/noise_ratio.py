from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define

from ..types import without_unset

T = TypeVar("T", bound="NoiseRatio")


@_attrs_define
class NoiseRatio:
    """A ratio of the variance of the noise to that of the heights, and how common it is.

    Attributes:
        ratio (float): The variance of the noise of a point divided by that of the heights.
        log_share (float): The natural logarithm of the share of neighbourhoods with this ratio.
    """

    ratio: float
    log_share: float

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        ratio = self.ratio

        log_share = self.log_share

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "ratio": ratio,
                "log_share": log_share,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        ratio = d.pop("ratio")

        log_share = d.pop("log_share")

        noise_ratio = cls(
            ratio=ratio,
            log_share=log_share,
        )

        return noise_ratio
