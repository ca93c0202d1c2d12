from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define

from ..types import without_unset

if TYPE_CHECKING:
    from ..models.noise_ratio import NoiseRatio


T = TypeVar("T", bound="MeansLevel")


@_attrs_define
class MeansLevel:
    """What local regressions over means of points learned.

    Attributes:
        points_per_mean (int): Most points of a mean.
        noise_ratios (list[NoiseRatio]): Mixture of noise ratios.
        flat_noise_ratios (list[NoiseRatio]): Mixture of noise ratios for normals where the surface is flat.
        normal_bias_shares (list[float]): Shares of the places at which normals are off those over fewer points by 0,
            0.1, 0.3, 1, 3, 10, 30,
            100 and 1,000 times the variance that noise explains.
        curvature_bias_shares (list[float]): The same of curvatures.
    """

    points_per_mean: int
    noise_ratios: list[NoiseRatio]
    flat_noise_ratios: list[NoiseRatio]
    normal_bias_shares: list[float]
    curvature_bias_shares: list[float]

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        points_per_mean = self.points_per_mean

        noise_ratios = []
        for noise_ratios_item_data in self.noise_ratios:
            noise_ratios_item = noise_ratios_item_data.to_dict()
            noise_ratios.append(noise_ratios_item)

        flat_noise_ratios = []
        for flat_noise_ratios_item_data in self.flat_noise_ratios:
            flat_noise_ratios_item = flat_noise_ratios_item_data.to_dict()
            flat_noise_ratios.append(flat_noise_ratios_item)

        normal_bias_shares = self.normal_bias_shares

        curvature_bias_shares = self.curvature_bias_shares

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "points_per_mean": points_per_mean,
                "noise_ratios": noise_ratios,
                "flat_noise_ratios": flat_noise_ratios,
                "normal_bias_shares": normal_bias_shares,
                "curvature_bias_shares": curvature_bias_shares,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.noise_ratio import NoiseRatio

        d = dict(src_dict)
        points_per_mean = d.pop("points_per_mean")

        noise_ratios = []
        _noise_ratios = d.pop("noise_ratios")
        for noise_ratios_item_data in _noise_ratios:
            noise_ratios_item = NoiseRatio.from_dict(noise_ratios_item_data)

            noise_ratios.append(noise_ratios_item)

        flat_noise_ratios = []
        _flat_noise_ratios = d.pop("flat_noise_ratios")
        for flat_noise_ratios_item_data in _flat_noise_ratios:
            flat_noise_ratios_item = NoiseRatio.from_dict(flat_noise_ratios_item_data)

            flat_noise_ratios.append(flat_noise_ratios_item)

        normal_bias_shares = cast(list[float], d.pop("normal_bias_shares"))

        curvature_bias_shares = cast(list[float], d.pop("curvature_bias_shares"))

        means_level = cls(
            points_per_mean=points_per_mean,
            noise_ratios=noise_ratios,
            flat_noise_ratios=flat_noise_ratios,
            normal_bias_shares=normal_bias_shares,
            curvature_bias_shares=curvature_bias_shares,
        )

        return means_level
