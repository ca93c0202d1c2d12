from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.means_level import MeansLevel
    from ..models.noise_ratio import NoiseRatio


T = TypeVar("T", bound="Hyperparameters")


@_attrs_define
class Hyperparameters:
    """What local regressions learned of a cloud.

    Send it back as it came, as `hyperparameters` of a request about a part of the cloud. It is opaque: its
    members may change in any version, and one of another version may be refused.

        Attributes:
            noise_ratios (list[NoiseRatio]): Mixture of noise ratios. Empty where nothing can be regressed.
            flat_noise_ratios (list[NoiseRatio]): Mixture of noise ratios for normals where the surface is flat. Empty where
                there is no noise.
            noise_deviation (float): Standard deviation of the noise of the points across the surface, length.
            length_scale (float): Length scale of the heights of the surface over its tangent planes.
            variance (float): Variance of these heights, length squared.
            radius (float): Half the diagonal of the bounding box of the cloud, length. Beside it, small curvatures count as
                0.
            rough_noise_ratios (list[NoiseRatio] | Unset): The part of this mixture with a rougher process, for curvatures
                that jump. Its shares count with those
                of `noise_ratios`.
            quartic_noise_ratios (list[NoiseRatio] | Unset): Mixture of noise ratios beside polynomials of fourth order.
                Empty where points have noise, or quadrics
                are as sure.
            means (list[MeansLevel] | Unset): Regressions over means of points, which are weighed with those over points at
                each place. Each
                level has twice as many points a mean as the one before, or more. Empty where points have no noise, or
                means are no surer.
            bend_noise_deviation (float | Unset): The same, or 0 where it may be bends of a coarsely sampled surface,
                length. Neighbourhoods do not take
                it for a bend.
            least_ratio (float | Unset): Least ratio of a curvature to its deviation at which the curvature counts as known.
                Absent if none
                is known.
    """

    noise_ratios: list[NoiseRatio]
    flat_noise_ratios: list[NoiseRatio]
    noise_deviation: float
    length_scale: float
    variance: float
    radius: float
    rough_noise_ratios: list[NoiseRatio] | Unset = UNSET
    quartic_noise_ratios: list[NoiseRatio] | Unset = UNSET
    means: list[MeansLevel] | Unset = UNSET
    bend_noise_deviation: float | Unset = UNSET
    least_ratio: float | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        noise_ratios = []
        for noise_ratios_item_data in self.noise_ratios:
            noise_ratios_item = noise_ratios_item_data.to_dict()
            noise_ratios.append(noise_ratios_item)

        flat_noise_ratios = []
        for flat_noise_ratios_item_data in self.flat_noise_ratios:
            flat_noise_ratios_item = flat_noise_ratios_item_data.to_dict()
            flat_noise_ratios.append(flat_noise_ratios_item)

        noise_deviation = self.noise_deviation

        length_scale = self.length_scale

        variance = self.variance

        radius = self.radius

        rough_noise_ratios: list[dict[str, Any]] | Unset = UNSET
        if not isinstance(self.rough_noise_ratios, Unset):
            rough_noise_ratios = []
            for rough_noise_ratios_item_data in self.rough_noise_ratios:
                rough_noise_ratios_item = rough_noise_ratios_item_data.to_dict()
                rough_noise_ratios.append(rough_noise_ratios_item)

        quartic_noise_ratios: list[dict[str, Any]] | Unset = UNSET
        if not isinstance(self.quartic_noise_ratios, Unset):
            quartic_noise_ratios = []
            for quartic_noise_ratios_item_data in self.quartic_noise_ratios:
                quartic_noise_ratios_item = quartic_noise_ratios_item_data.to_dict()
                quartic_noise_ratios.append(quartic_noise_ratios_item)

        means: list[dict[str, Any]] | Unset = UNSET
        if not isinstance(self.means, Unset):
            means = []
            for means_item_data in self.means:
                means_item = means_item_data.to_dict()
                means.append(means_item)

        bend_noise_deviation = self.bend_noise_deviation

        least_ratio = self.least_ratio

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "noise_ratios": noise_ratios,
                "flat_noise_ratios": flat_noise_ratios,
                "noise_deviation": noise_deviation,
                "length_scale": length_scale,
                "variance": variance,
                "radius": radius,
            }
        )
        if rough_noise_ratios is not UNSET:
            field_dict["rough_noise_ratios"] = rough_noise_ratios
        if quartic_noise_ratios is not UNSET:
            field_dict["quartic_noise_ratios"] = quartic_noise_ratios
        if means is not UNSET:
            field_dict["means"] = means
        if bend_noise_deviation is not UNSET:
            field_dict["bend_noise_deviation"] = bend_noise_deviation
        if least_ratio is not UNSET:
            field_dict["least_ratio"] = least_ratio

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.means_level import MeansLevel
        from ..models.noise_ratio import NoiseRatio

        d = dict(src_dict)
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

        noise_deviation = d.pop("noise_deviation")

        length_scale = d.pop("length_scale")

        variance = d.pop("variance")

        radius = d.pop("radius")

        _rough_noise_ratios = d.pop("rough_noise_ratios", UNSET)
        rough_noise_ratios: list[NoiseRatio] | Unset = UNSET
        if _rough_noise_ratios is not UNSET:
            rough_noise_ratios = []
            for rough_noise_ratios_item_data in _rough_noise_ratios:
                rough_noise_ratios_item = NoiseRatio.from_dict(rough_noise_ratios_item_data)

                rough_noise_ratios.append(rough_noise_ratios_item)

        _quartic_noise_ratios = d.pop("quartic_noise_ratios", UNSET)
        quartic_noise_ratios: list[NoiseRatio] | Unset = UNSET
        if _quartic_noise_ratios is not UNSET:
            quartic_noise_ratios = []
            for quartic_noise_ratios_item_data in _quartic_noise_ratios:
                quartic_noise_ratios_item = NoiseRatio.from_dict(quartic_noise_ratios_item_data)

                quartic_noise_ratios.append(quartic_noise_ratios_item)

        _means = d.pop("means", UNSET)
        means: list[MeansLevel] | Unset = UNSET
        if _means is not UNSET:
            means = []
            for means_item_data in _means:
                means_item = MeansLevel.from_dict(means_item_data)

                means.append(means_item)

        bend_noise_deviation = d.pop("bend_noise_deviation", UNSET)

        least_ratio = d.pop("least_ratio", UNSET)

        hyperparameters = cls(
            noise_ratios=noise_ratios,
            flat_noise_ratios=flat_noise_ratios,
            noise_deviation=noise_deviation,
            length_scale=length_scale,
            variance=variance,
            radius=radius,
            rough_noise_ratios=rough_noise_ratios,
            quartic_noise_ratios=quartic_noise_ratios,
            means=means,
            bend_noise_deviation=bend_noise_deviation,
            least_ratio=least_ratio,
        )

        return hyperparameters
