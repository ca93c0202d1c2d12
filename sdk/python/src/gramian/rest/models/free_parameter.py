from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define

from ..models.selection_parameter import SelectionParameter
from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="FreeParameter")


@_attrs_define
class FreeParameter:
    """A parameter that is free between bounds.

    Attributes:
        parameter (SelectionParameter): What may be free.
        min_ (float): The least that it may be.
        max_ (float): The greatest that it may be.
        axis (int | Unset): length_scales: the axis, from 0; every axis if absent, each within these bounds.
    """

    parameter: SelectionParameter
    min_: float
    max_: float
    axis: int | Unset = UNSET

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        parameter = self.parameter.value

        min_ = self.min_

        max_ = self.max_

        axis = self.axis

        field_dict: dict[str, Any] = {}

        field_dict.update(
            {
                "parameter": parameter,
                "min": min_,
                "max": max_,
            }
        )
        if axis is not UNSET:
            field_dict["axis"] = axis

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        parameter = SelectionParameter(d.pop("parameter"))

        min_ = d.pop("min")

        max_ = d.pop("max")

        axis = d.pop("axis", UNSET)

        free_parameter = cls(
            parameter=parameter,
            min_=min_,
            max_=max_,
            axis=axis,
        )

        return free_parameter
