from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define

from ..types import without_unset

if TYPE_CHECKING:
    from ..models.link import Link
    from ..models.tile_regions import TileRegions


T = TypeVar("T", bound="SidesRequest")


@_attrs_define
class SidesRequest:
    """The regions of all tiles of a cloud, and which of them are parts of one region.

    Attributes:
        tiles (list[TileRegions]): The regions of each tile, as `POST /v1/regions` answers them.
        links (list[Link]): Pairs of regions that have a point in common, counted on from one tile to the next.
    """

    tiles: list[TileRegions]
    links: list[Link]

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        tiles = []
        for tiles_item_data in self.tiles:
            tiles_item = tiles_item_data.to_dict()
            tiles.append(tiles_item)

        links = []
        for links_item_data in self.links:
            links_item = links_item_data.to_dict()
            links.append(links_item)

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "tiles": tiles,
                "links": links,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.link import Link
        from ..models.tile_regions import TileRegions

        d = dict(src_dict)
        tiles = []
        _tiles = d.pop("tiles")
        for tiles_item_data in _tiles:
            tiles_item = TileRegions.from_dict(tiles_item_data)

            tiles.append(tiles_item)

        links = []
        _links = d.pop("links")
        for links_item_data in _links:
            links_item = Link.from_dict(links_item_data)

            links.append(links_item)

        sides_request = cls(
            tiles=tiles,
            links=links,
        )

        return sides_request
