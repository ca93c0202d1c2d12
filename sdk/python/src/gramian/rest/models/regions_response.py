from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

if TYPE_CHECKING:
    from ..models.border import Border
    from ..models.diagnostics import Diagnostics
    from ..models.region import Region


T = TypeVar("T", bound="RegionsResponse")


@_attrs_define
class RegionsResponse:
    """The regions of a tile, with sums that decide their sides.

    Attributes:
        labels (list[int]): The region of each point of the tile, or −1 for points around it that no edge leads to.
        regions (list[Region]): The regions.
        borders (list[Border]): The borders between regions, and the edges within each.
        n_edges (int): The number of edges that the points would have on a surface that is sampled well.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
    """

    labels: list[int]
    regions: list[Region]
    borders: list[Border]
    n_edges: int
    diagnostics: Diagnostics
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        labels = self.labels

        regions = []
        for regions_item_data in self.regions:
            regions_item = regions_item_data.to_dict()
            regions.append(regions_item)

        borders = []
        for borders_item_data in self.borders:
            borders_item = borders_item_data.to_dict()
            borders.append(borders_item)

        n_edges = self.n_edges

        diagnostics = self.diagnostics.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "labels": labels,
                "regions": regions,
                "borders": borders,
                "n_edges": n_edges,
                "diagnostics": diagnostics,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.border import Border
        from ..models.diagnostics import Diagnostics
        from ..models.region import Region

        d = dict(src_dict)
        labels = cast(list[int], d.pop("labels"))

        regions = []
        _regions = d.pop("regions")
        for regions_item_data in _regions:
            regions_item = Region.from_dict(regions_item_data)

            regions.append(regions_item)

        borders = []
        _borders = d.pop("borders")
        for borders_item_data in _borders:
            borders_item = Border.from_dict(borders_item_data)

            borders.append(borders_item)

        n_edges = d.pop("n_edges")

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        regions_response = cls(
            labels=labels,
            regions=regions,
            borders=borders,
            n_edges=n_edges,
            diagnostics=diagnostics,
        )

        regions_response.additional_properties = d
        return regions_response

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
