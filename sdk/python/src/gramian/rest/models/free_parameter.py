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
        parameter (SelectionParameter): A parameter that may be free.
        min_ (float): The lower bound.
        max_ (float): The upper bound.
        axis (int | Unset): The axis, from 0, for `length_scales` only. Default: every axis, each within these bounds.
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
