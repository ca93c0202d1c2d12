from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

T = TypeVar("T", bound="StencilCounts")


@_attrs_define
class StencilCounts:
    """Number of rows of a sparse operator by how their weights were computed.

    Attributes:
        nearest (int): Polyharmonic splines on the nearest nodes: the ordinary row.
        graded (int): Polyharmonic splines on nodes that thin out with distance, used where the nearest nodes lie on one
            side.
        positive (int): Weights that are not negative beside the diagonal, used where no splines give a stable row, as
            at a
            rim.
        least_norm (int): Least squares of least norm, used where the nodes do not determine derivatives.
        empty (int): Rows without entries.
    """

    nearest: int
    graded: int
    positive: int
    least_norm: int
    empty: int
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        nearest = self.nearest

        graded = self.graded

        positive = self.positive

        least_norm = self.least_norm

        empty = self.empty

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "nearest": nearest,
                "graded": graded,
                "positive": positive,
                "least_norm": least_norm,
                "empty": empty,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        nearest = d.pop("nearest")

        graded = d.pop("graded")

        positive = d.pop("positive")

        least_norm = d.pop("least_norm")

        empty = d.pop("empty")

        stencil_counts = cls(
            nearest=nearest,
            graded=graded,
            positive=positive,
            least_norm=least_norm,
            empty=empty,
        )

        stencil_counts.additional_properties = d
        return stencil_counts

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
