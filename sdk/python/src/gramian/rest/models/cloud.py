from __future__ import annotations

import datetime
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.bounding_box import BoundingBox
    from ..models.spacing import Spacing


T = TypeVar("T", bound="Cloud")


@_attrs_define
class Cloud:
    """A registered cloud.

    Attributes:
        cloud_id (str): The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and the normals if given.
        n_points (int): Number of points, n.
        dimension (int): Number of coordinates of each point, d.
        bounding_box (BoundingBox): The smallest box around a cloud.
        n_duplicates (int): Number of points that coincide with an earlier point.
        created_at (datetime.datetime): The time of registration, in UTC.
        spacing (Spacing | Unset): Statistics of the distance from each point to the nearest point elsewhere.
    """

    cloud_id: str
    n_points: int
    dimension: int
    bounding_box: BoundingBox
    n_duplicates: int
    created_at: datetime.datetime
    spacing: Spacing | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        cloud_id = self.cloud_id

        n_points = self.n_points

        dimension = self.dimension

        bounding_box = self.bounding_box.to_dict()

        n_duplicates = self.n_duplicates

        created_at = self.created_at.isoformat()

        spacing: dict[str, Any] | Unset = UNSET
        if not isinstance(self.spacing, Unset):
            spacing = self.spacing.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "cloud_id": cloud_id,
                "n_points": n_points,
                "dimension": dimension,
                "bounding_box": bounding_box,
                "n_duplicates": n_duplicates,
                "created_at": created_at,
            }
        )
        if spacing is not UNSET:
            field_dict["spacing"] = spacing

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.bounding_box import BoundingBox
        from ..models.spacing import Spacing

        d = dict(src_dict)
        cloud_id = d.pop("cloud_id")

        n_points = d.pop("n_points")

        dimension = d.pop("dimension")

        bounding_box = BoundingBox.from_dict(d.pop("bounding_box"))

        n_duplicates = d.pop("n_duplicates")

        created_at = datetime.datetime.fromisoformat(d.pop("created_at"))

        _spacing = d.pop("spacing", UNSET)
        spacing: Spacing | Unset
        if isinstance(_spacing, Unset):
            spacing = UNSET
        else:
            spacing = Spacing.from_dict(_spacing)

        cloud = cls(
            cloud_id=cloud_id,
            n_points=n_points,
            dimension=dimension,
            bounding_box=bounding_box,
            n_duplicates=n_duplicates,
            created_at=created_at,
            spacing=spacing,
        )

        cloud.additional_properties = d
        return cloud

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
