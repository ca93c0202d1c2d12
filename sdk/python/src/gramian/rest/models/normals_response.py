from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.surface_used import SurfaceUsed
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.degenerate import Degenerate
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="NormalsResponse")


@_attrs_define
class NormalsResponse:
    """Unit normals of the surface at the queries.

    Attributes:
        normals (list[list[float] | None]): The normal at each query, of length 1. Null where there is none.
        gradient_norms (list[float]): |∇u| at each query for the function in `surfaces`: unit 1/length for `signature`,
            about 1 for
            `offset`.
        levels (list[float]): The signature function at each query: 1 on the surface, usually more inside a closed one.
        surfaces (list[SurfaceUsed]): The function whose level surface was used at each query. It is `signature` where
            there is no
            answer.
        degenerate (list[Degenerate]): The queries where geometry has no meaning (null), or less accuracy than it seems.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
        normal_deviations (list[float | None] | Unset): Standard deviation of the angle of the normal at each query,
            radians.

            95 % of the angles lie within 1.96 standard deviations. Null where there is no answer or the
            deviation is not known.
    """

    normals: list[list[float] | None]
    gradient_norms: list[float]
    levels: list[float]
    surfaces: list[SurfaceUsed]
    degenerate: list[Degenerate]
    diagnostics: Diagnostics
    normal_deviations: list[float | None] | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        normals = []
        for normals_item_data in self.normals:
            normals_item: list[float] | None
            if isinstance(normals_item_data, list):
                normals_item = normals_item_data

            else:
                normals_item = normals_item_data
            normals.append(normals_item)

        gradient_norms = self.gradient_norms

        levels = self.levels

        surfaces = []
        for surfaces_item_data in self.surfaces:
            surfaces_item = surfaces_item_data.value
            surfaces.append(surfaces_item)

        degenerate = []
        for degenerate_item_data in self.degenerate:
            degenerate_item = degenerate_item_data.to_dict()
            degenerate.append(degenerate_item)

        diagnostics = self.diagnostics.to_dict()

        normal_deviations: list[float | None] | Unset = UNSET
        if not isinstance(self.normal_deviations, Unset):
            normal_deviations = []
            for normal_deviations_item_data in self.normal_deviations:
                normal_deviations_item: float | None
                normal_deviations_item = normal_deviations_item_data
                normal_deviations.append(normal_deviations_item)

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "normals": normals,
                "gradient_norms": gradient_norms,
                "levels": levels,
                "surfaces": surfaces,
                "degenerate": degenerate,
                "diagnostics": diagnostics,
            }
        )
        if normal_deviations is not UNSET:
            field_dict["normal_deviations"] = normal_deviations

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.degenerate import Degenerate
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        normals = []
        _normals = d.pop("normals")
        for normals_item_data in _normals:

            def _parse_normals_item(data: object) -> list[float] | None:
                if data is None:
                    return data
                try:
                    if not isinstance(data, list):
                        raise TypeError()
                    normals_item_type_0 = cast(list[float], data)

                    return normals_item_type_0
                except (TypeError, ValueError, AttributeError, KeyError):
                    pass
                return cast(list[float] | None, data)

            normals_item = _parse_normals_item(normals_item_data)

            normals.append(normals_item)

        gradient_norms = cast(list[float], d.pop("gradient_norms"))

        levels = cast(list[float], d.pop("levels"))

        surfaces = []
        _surfaces = d.pop("surfaces")
        for surfaces_item_data in _surfaces:
            surfaces_item = SurfaceUsed(surfaces_item_data)

            surfaces.append(surfaces_item)

        degenerate = []
        _degenerate = d.pop("degenerate")
        for degenerate_item_data in _degenerate:
            degenerate_item = Degenerate.from_dict(degenerate_item_data)

            degenerate.append(degenerate_item)

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        _normal_deviations = d.pop("normal_deviations", UNSET)
        normal_deviations: list[float | None] | Unset = UNSET
        if _normal_deviations is not UNSET:
            normal_deviations = []
            for normal_deviations_item_data in _normal_deviations:

                def _parse_normal_deviations_item(data: object) -> float | None:
                    if data is None:
                        return data
                    return cast(float | None, data)

                normal_deviations_item = _parse_normal_deviations_item(normal_deviations_item_data)

                normal_deviations.append(normal_deviations_item)

        normals_response = cls(
            normals=normals,
            gradient_norms=gradient_norms,
            levels=levels,
            surfaces=surfaces,
            degenerate=degenerate,
            diagnostics=diagnostics,
            normal_deviations=normal_deviations,
        )

        normals_response.additional_properties = d
        return normals_response

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
