from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

if TYPE_CHECKING:
    from ..models.degenerate import Degenerate
    from ..models.diagnostics import Diagnostics


T = TypeVar("T", bound="SurfaceGradientMatrixResponse")


@_attrs_define
class SurfaceGradientMatrixResponse:
    """The surface gradient as matrices.

    Attributes:
        matrices (list[list[list[float] | None]]): A matrix per coordinate, unit 1/length. Rows are queries, and columns
            are the points of `cloud`.

            A row is null where there is no normal.
        degenerate (list[Degenerate]): The queries where geometry has no meaning (null), or less accuracy than it seems.
        diagnostics (Diagnostics): Diagnostics of an answer: the numbers used, the method, and its accuracy.
    """

    matrices: list[list[list[float] | None]]
    degenerate: list[Degenerate]
    diagnostics: Diagnostics
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        matrices = []
        for matrices_item_data in self.matrices:
            matrices_item = []
            for matrices_item_item_data in matrices_item_data:
                matrices_item_item: list[float] | None
                if isinstance(matrices_item_item_data, list):
                    matrices_item_item = matrices_item_item_data

                else:
                    matrices_item_item = matrices_item_item_data
                matrices_item.append(matrices_item_item)

            matrices.append(matrices_item)

        degenerate = []
        for degenerate_item_data in self.degenerate:
            degenerate_item = degenerate_item_data.to_dict()
            degenerate.append(degenerate_item)

        diagnostics = self.diagnostics.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "matrices": matrices,
                "degenerate": degenerate,
                "diagnostics": diagnostics,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.degenerate import Degenerate
        from ..models.diagnostics import Diagnostics

        d = dict(src_dict)
        matrices = []
        _matrices = d.pop("matrices")
        for matrices_item_data in _matrices:
            matrices_item = []
            _matrices_item = matrices_item_data
            for matrices_item_item_data in _matrices_item:

                def _parse_matrices_item_item(data: object) -> list[float] | None:
                    if data is None:
                        return data
                    try:
                        if not isinstance(data, list):
                            raise TypeError()
                        matrices_item_item_type_0 = cast(list[float], data)

                        return matrices_item_item_type_0
                    except (TypeError, ValueError, AttributeError, KeyError):
                        pass
                    return cast(list[float] | None, data)

                matrices_item_item = _parse_matrices_item_item(matrices_item_item_data)

                matrices_item.append(matrices_item_item)

            matrices.append(matrices_item)

        degenerate = []
        _degenerate = d.pop("degenerate")
        for degenerate_item_data in _degenerate:
            degenerate_item = Degenerate.from_dict(degenerate_item_data)

            degenerate.append(degenerate_item)

        diagnostics = Diagnostics.from_dict(d.pop("diagnostics"))

        surface_gradient_matrix_response = cls(
            matrices=matrices,
            degenerate=degenerate,
            diagnostics=diagnostics,
        )

        surface_gradient_matrix_response.additional_properties = d
        return surface_gradient_matrix_response

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
