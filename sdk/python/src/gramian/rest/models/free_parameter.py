from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define

from ..models.selection_parameter import SelectionParameter
from ..types import without_unset

T = TypeVar("T", bound="FreeParameter")


@_attrs_define
class FreeParameter:
    """A parameter that is free between bounds.

    Attributes:
        parameter (SelectionParameter): What may be free.
        min_ (float): The least that it may be.
        max_ (float): The greatest that it may be.
    """

    parameter: SelectionParameter
    min_: float
    max_: float

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        parameter = self.parameter.value

        min_ = self.min_

        max_ = self.max_

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "parameter": parameter,
                "min": min_,
                "max": max_,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        parameter = SelectionParameter(d.pop("parameter"))

        min_ = d.pop("min")

        max_ = d.pop("max")

        free_parameter = cls(
            parameter=parameter,
            min_=min_,
            max_=max_,
        )

        return free_parameter
