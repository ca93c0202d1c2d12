from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

if TYPE_CHECKING:
    from ..models.kernel_used import KernelUsed


T = TypeVar("T", bound="CoarseResponse")


@_attrs_define
class CoarseResponse:
    """A coarse cloud with the kernel and alpha of its signature function.

    Attributes:
        points (list[int]): The points, by their positions in the cloud, ascending. No two coincide.
        kernel (KernelUsed): The kernel that was used, with every number. Sent back as `kernel`, it gives the same
            answer.
        alpha (float): Added to the diagonal of its matrix.
    """

    points: list[int]
    kernel: KernelUsed
    alpha: float
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        points = self.points

        kernel = self.kernel.to_dict()

        alpha = self.alpha

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "points": points,
                "kernel": kernel,
                "alpha": alpha,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.kernel_used import KernelUsed

        d = dict(src_dict)
        points = cast(list[int], d.pop("points"))

        kernel = KernelUsed.from_dict(d.pop("kernel"))

        alpha = d.pop("alpha")

        coarse_response = cls(
            points=points,
            kernel=kernel,
            alpha=alpha,
        )

        coarse_response.additional_properties = d
        return coarse_response

    @property
    def additional_keys(self) -> list[str]:
        return list(self.additional_properties.keys())

    def __getitem__(self, key: str) -> Any:
        return self.additional_properties[key]

    def __setitem__(self, key: str, value: Any) -> None:
        self.additional_properties[key] = value

    def __delitem__(self, key: str) -> None:
        del self.additional_properties[key]

    def __contains__(self, key: str) -> bool:
        return key in self.additional_properties
