from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

T = TypeVar("T", bound="MeshPart")


@_attrs_define
class MeshPart:
    """A connected part of a mesh.

    Attributes:
        n_vertices (int): Number of its vertices.
        n_cells (int): Number of its segments or triangles.
        euler_characteristic (int): Vertices − segments, or vertices − edges + triangles: 0 for a closed curve, 2 for a
            sphere, 0 for
            a torus.
        n_boundary_edges (int): Number of edges (in the plane: ends) that belong to a single cell. 0 if the part is
            closed.
        area (float): The area in the square of the unit of the points, or the length of a curve.
        n_far_vertices (int): Number of its vertices that are farther than three spacings from all points.
    """

    n_vertices: int
    n_cells: int
    euler_characteristic: int
    n_boundary_edges: int
    area: float
    n_far_vertices: int
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        n_vertices = self.n_vertices

        n_cells = self.n_cells

        euler_characteristic = self.euler_characteristic

        n_boundary_edges = self.n_boundary_edges

        area = self.area

        n_far_vertices = self.n_far_vertices

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "n_vertices": n_vertices,
                "n_cells": n_cells,
                "euler_characteristic": euler_characteristic,
                "n_boundary_edges": n_boundary_edges,
                "area": area,
                "n_far_vertices": n_far_vertices,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        n_vertices = d.pop("n_vertices")

        n_cells = d.pop("n_cells")

        euler_characteristic = d.pop("euler_characteristic")

        n_boundary_edges = d.pop("n_boundary_edges")

        area = d.pop("area")

        n_far_vertices = d.pop("n_far_vertices")

        mesh_part = cls(
            n_vertices=n_vertices,
            n_cells=n_cells,
            euler_characteristic=euler_characteristic,
            n_boundary_edges=n_boundary_edges,
            area=area,
            n_far_vertices=n_far_vertices,
        )

        mesh_part.additional_properties = d
        return mesh_part

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
