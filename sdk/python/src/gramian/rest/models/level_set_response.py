from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.vertex_support import VertexSupport
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.diagnostics import Diagnostics
    from ..models.mesh_part import MeshPart


T = TypeVar("T", bound="LevelSetResponse")


@_attrs_define
class LevelSetResponse:
    """A mesh of segments (in the plane) or triangles (in space).

    Attributes:
        vertices (list[list[float]]): The vertices, one row of coordinates each.
        cells (list[list[int]]): The vertices of each segment or triangle, by index from 0.

            Seen from the side that normals point to, triangles run counter-clockwise. Segments run
            counter-clockwise around the inside.
        normals (list[list[float]]): The normal at each vertex, of length 1.
        support (list[VertexSupport]): What each vertex rests on.
        residuals (list[float | None]): The distance of each vertex from the level, to first order, in the unit of the
            points.

            Null where the function is flat.
        parts (list[MeshPart]): The connected parts of the mesh, largest first.
        dropped_parts (list[MeshPart]): Parts that were left out: no point is near them, they have too few points of
            their own, or they
            are too small to mean anything.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
        principal_curvatures (list[list[float] | None] | Unset): The d − 1 principal curvatures at each vertex,
            ascending, 1/length.
        mean_curvatures (list[float | None] | Unset): The average of the principal curvatures at each vertex, 1/length.
        position_deviations (list[float | None] | Unset): The standard deviation of each vertex along its normal, in the
            unit of the points.

            Null where it is not known.
        normal_deviations (list[float | None] | Unset): The standard deviation of the angle of the normal at each
            vertex, radians.
        principal_curvature_deviations (list[list[float] | None] | Unset): Standard deviations of the principal
            curvatures at each vertex, 1/length.
        mean_curvature_deviations (list[float | None] | Unset): Standard deviations of the mean curvatures, 1/length.
        closedness (float | Unset): The share of the points with the inside on one side and the outside on the other, by
            winding
            numbers.

            Absent for a level of values.
    """

    vertices: list[list[float]]
    cells: list[list[int]]
    normals: list[list[float]]
    support: list[VertexSupport]
    residuals: list[float | None]
    parts: list[MeshPart]
    dropped_parts: list[MeshPart]
    diagnostics: Diagnostics
    principal_curvatures: list[list[float] | None] | Unset = UNSET
    mean_curvatures: list[float | None] | Unset = UNSET
    position_deviations: list[float | None] | Unset = UNSET
    normal_deviations: list[float | None] | Unset = UNSET
    principal_curvature_deviations: list[list[float] | None] | Unset = UNSET
    mean_curvature_deviations: list[float | None] | Unset = UNSET
    closedness: float | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        vertices = []
        for vertices_item_data in self.vertices:
            vertices_item = vertices_item_data

            vertices.append(vertices_item)

        cells = []
        for cells_item_data in self.cells:
            cells_item = cells_item_data

            cells.append(cells_item)

        normals = []
        for normals_item_data in self.normals:
            normals_item = normals_item_data

            normals.append(normals_item)

        support = []
        for support_item_data in self.support:
            support_item = support_item_data.value
            support.append(support_item)

        residuals = []
        for residuals_item_data in self.residuals:
            residuals_item: float | None
            residuals_item = residuals_item_data
            residuals.append(residuals_item)

        parts = []
        for parts_item_data in self.parts:
            parts_item = parts_item_data.to_dict()
            parts.append(parts_item)

        dropped_parts = []
        for dropped_parts_item_data in self.dropped_parts:
            dropped_parts_item = dropped_parts_item_data.to_dict()
            dropped_parts.append(dropped_parts_item)

        diagnostics = self.diagnostics.to_dict()

        principal_curvatures: list[list[float] | None] | Unset = UNSET
        if not isinstance(self.principal_curvatures, Unset):
            principal_curvatures = []
            for principal_curvatures_item_data in self.principal_curvatures:
                principal_curvatures_item: list[float] | None
                if isinstance(principal_curvatures_item_data, list):
                    principal_curvatures_item = principal_curvatures_item_data

                else:
                    principal_curvatures_item = principal_curvatures_item_data
                principal_curvatures.append(principal_curvatures_item)

        mean_curvatures: list[float | None] | Unset = UNSET
        if not isinstance(self.mean_curvatures, Unset):
            mean_curvatures = []
            for mean_curvatures_item_data in self.mean_curvatures:
                mean_curvatures_item: float | None
                mean_curvatures_item = mean_curvatures_item_data
                mean_curvatures.append(mean_curvatures_item)

        position_deviations: list[float | None] | Unset = UNSET
        if not isinstance(self.position_deviations, Unset):
            position_deviations = []
            for position_deviations_item_data in self.position_deviations:
                position_deviations_item: float | None
                position_deviations_item = position_deviations_item_data
                position_deviations.append(position_deviations_item)

        normal_deviations: list[float | None] | Unset = UNSET
        if not isinstance(self.normal_deviations, Unset):
            normal_deviations = []
            for normal_deviations_item_data in self.normal_deviations:
                normal_deviations_item: float | None
                normal_deviations_item = normal_deviations_item_data
                normal_deviations.append(normal_deviations_item)

        principal_curvature_deviations: list[list[float] | None] | Unset = UNSET
        if not isinstance(self.principal_curvature_deviations, Unset):
            principal_curvature_deviations = []
            for principal_curvature_deviations_item_data in self.principal_curvature_deviations:
                principal_curvature_deviations_item: list[float] | None
                if isinstance(principal_curvature_deviations_item_data, list):
                    principal_curvature_deviations_item = principal_curvature_deviations_item_data

                else:
                    principal_curvature_deviations_item = principal_curvature_deviations_item_data
                principal_curvature_deviations.append(principal_curvature_deviations_item)

        mean_curvature_deviations: list[float | None] | Unset = UNSET
        if not isinstance(self.mean_curvature_deviations, Unset):
            mean_curvature_deviations = []
            for mean_curvature_deviations_item_data in self.mean_curvature_deviations:
                mean_curvature_deviations_item: float | None
                mean_curvature_deviations_item = mean_curvature_deviations_item_data
                mean_curvature_deviations.append(mean_curvature_deviations_item)

        closedness = self.closedness

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "vertices": vertices,
                "cells": cells,
                "normals": normals,
                "support": support,
                "residuals": residuals,
                "parts": parts,
                "dropped_parts": dropped_parts,
                "diagnostics": diagnostics,
            }
        )
        if principal_curvatures is not UNSET:
            field_dict["principal_curvatures"] = principal_curvatures
        if mean_curvatures is not UNSET:
            field_dict["mean_curvatures"] = mean_curvatures
        if position_deviations is not UNSET:
            field_dict["position_deviations"] = position_deviations
        if normal_deviations is not UNSET:
            field_dict["normal_deviations"] = normal_deviations
        if principal_curvature_deviations is not UNSET:
            field_dict["principal_curvature_deviations"] = principal_curvature_deviations
        if mean_curvature_deviations is not UNSET:
            field_dict["mean_curvature_deviations"] = mean_curvature_deviations
        if closedness is not UNSET:
            field_dict["closedness"] = closedness

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.diagnostics import Diagnostics
        from ..models.mesh_part import MeshPart

        d = dict(src_dict)
        vertices = []
        _vertices = d.pop("vertices")
        for vertices_item_data in _vertices:
            vertices_item = cast(list[float], vertices_item_data)

            vertices.append(vertices_item)

        cells = []
        _cells = d.pop("cells")
        for cells_item_data in _cells:
            cells_item = cast(list[int], cells_item_data)

            cells.append(cells_item)

        normals = []
        _normals = d.pop("normals")
        for normals_item_data in _normals:
            normals_item = cast(list[float], normals_item_data)

            normals.append(normals_item)

        support = []
        _support = d.pop("support")
        for support_item_data in _support:
            support_item = VertexSupport(support_item_data)

            support.append(support_item)

        residuals = []
        _residuals = d.pop("residuals")
        for residuals_item_data in _residuals:

            def _parse_residuals_item(data: object) -> float | None:
                if data is None:
                    return data
                return cast(float | None, data)

            residuals_item = _parse_residuals_item(residuals_item_data)

            residuals.append(residuals_item)

        parts = []
        _parts = d.pop("parts")
        for parts_item_data in _parts:
            parts_item = MeshPart.from_dict(parts_item_data)

            parts.append(parts_item)

        dropped_parts = []
        _dropped_parts = d.pop("dropped_parts")
        for dropped_parts_item_data in _dropped_parts:
            dropped_parts_item = MeshPart.from_dict(dropped_parts_item_data)

            dropped_parts.append(dropped_parts_item)

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        _principal_curvatures = d.pop("principal_curvatures", UNSET)
        principal_curvatures: list[list[float] | None] | Unset = UNSET
        if _principal_curvatures is not UNSET:
            principal_curvatures = []
            for principal_curvatures_item_data in _principal_curvatures:

                def _parse_principal_curvatures_item(data: object) -> list[float] | None:
                    if data is None:
                        return data
                    try:
                        if not isinstance(data, list):
                            raise TypeError()
                        principal_curvatures_item_type_0 = cast(list[float], data)

                        return principal_curvatures_item_type_0
                    except (TypeError, ValueError, AttributeError, KeyError):
                        pass
                    return cast(list[float] | None, data)

                principal_curvatures_item = _parse_principal_curvatures_item(principal_curvatures_item_data)

                principal_curvatures.append(principal_curvatures_item)

        _mean_curvatures = d.pop("mean_curvatures", UNSET)
        mean_curvatures: list[float | None] | Unset = UNSET
        if _mean_curvatures is not UNSET:
            mean_curvatures = []
            for mean_curvatures_item_data in _mean_curvatures:

                def _parse_mean_curvatures_item(data: object) -> float | None:
                    if data is None:
                        return data
                    return cast(float | None, data)

                mean_curvatures_item = _parse_mean_curvatures_item(mean_curvatures_item_data)

                mean_curvatures.append(mean_curvatures_item)

        _position_deviations = d.pop("position_deviations", UNSET)
        position_deviations: list[float | None] | Unset = UNSET
        if _position_deviations is not UNSET:
            position_deviations = []
            for position_deviations_item_data in _position_deviations:

                def _parse_position_deviations_item(data: object) -> float | None:
                    if data is None:
                        return data
                    return cast(float | None, data)

                position_deviations_item = _parse_position_deviations_item(position_deviations_item_data)

                position_deviations.append(position_deviations_item)

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

        _principal_curvature_deviations = d.pop("principal_curvature_deviations", UNSET)
        principal_curvature_deviations: list[list[float] | None] | Unset = UNSET
        if _principal_curvature_deviations is not UNSET:
            principal_curvature_deviations = []
            for principal_curvature_deviations_item_data in _principal_curvature_deviations:

                def _parse_principal_curvature_deviations_item(data: object) -> list[float] | None:
                    if data is None:
                        return data
                    try:
                        if not isinstance(data, list):
                            raise TypeError()
                        principal_curvature_deviations_item_type_0 = cast(list[float], data)

                        return principal_curvature_deviations_item_type_0
                    except (TypeError, ValueError, AttributeError, KeyError):
                        pass
                    return cast(list[float] | None, data)

                principal_curvature_deviations_item = _parse_principal_curvature_deviations_item(
                    principal_curvature_deviations_item_data
                )

                principal_curvature_deviations.append(principal_curvature_deviations_item)

        _mean_curvature_deviations = d.pop("mean_curvature_deviations", UNSET)
        mean_curvature_deviations: list[float | None] | Unset = UNSET
        if _mean_curvature_deviations is not UNSET:
            mean_curvature_deviations = []
            for mean_curvature_deviations_item_data in _mean_curvature_deviations:

                def _parse_mean_curvature_deviations_item(data: object) -> float | None:
                    if data is None:
                        return data
                    return cast(float | None, data)

                mean_curvature_deviations_item = _parse_mean_curvature_deviations_item(
                    mean_curvature_deviations_item_data
                )

                mean_curvature_deviations.append(mean_curvature_deviations_item)

        closedness = d.pop("closedness", UNSET)

        level_set_response = cls(
            vertices=vertices,
            cells=cells,
            normals=normals,
            support=support,
            residuals=residuals,
            parts=parts,
            dropped_parts=dropped_parts,
            diagnostics=diagnostics,
            principal_curvatures=principal_curvatures,
            mean_curvatures=mean_curvatures,
            position_deviations=position_deviations,
            normal_deviations=normal_deviations,
            principal_curvature_deviations=principal_curvature_deviations,
            mean_curvature_deviations=mean_curvature_deviations,
            closedness=closedness,
        )

        level_set_response.additional_properties = d
        return level_set_response

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
