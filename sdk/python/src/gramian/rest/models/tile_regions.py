from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define

from ..types import without_unset

if TYPE_CHECKING:
    from ..models.region import Region
    from ..models.region_adjacency import RegionAdjacency


T = TypeVar("T", bound="TileRegions")


@_attrs_define
class TileRegions:
    """The regions of a tile.

    Attributes:
        regions (list[Region]): The regions.
        borders (list[RegionAdjacency]): Their borders.
        n_edges (int): The number of edges that the points would have on a surface that is sampled well.
    """

    regions: list[Region]
    borders: list[RegionAdjacency]
    n_edges: int

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        regions = []
        for regions_item_data in self.regions:
            regions_item = regions_item_data.to_dict()
            regions.append(regions_item)

        borders = []
        for borders_item_data in self.borders:
            borders_item = borders_item_data.to_dict()
            borders.append(borders_item)

        n_edges = self.n_edges

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "regions": regions,
                "borders": borders,
                "n_edges": n_edges,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.region import Region
        from ..models.region_adjacency import RegionAdjacency

        d = dict(src_dict)
        regions = []
        _regions = d.pop("regions")
        for regions_item_data in _regions:
            regions_item = Region.from_dict(regions_item_data)

            regions.append(regions_item)

        borders = []
        _borders = d.pop("borders")
        for borders_item_data in _borders:
            borders_item = RegionAdjacency.from_dict(borders_item_data)

            borders.append(borders_item)

        n_edges = d.pop("n_edges")

        tile_regions = cls(
            regions=regions,
            borders=borders,
            n_edges=n_edges,
        )

        return tile_regions
