from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.flag_reason import FlagReason
from ..types import without_unset

T = TypeVar("T", bound="Flag")


@_attrs_define
class Flag:
    """A query where geometry has no meaning, or less accuracy than it seems.

    Attributes:
        query (int): The position of the query.
        reason (FlagReason): The reason why a query has a flag.
        gradient_norm (float): |∇| of the function used at the query.

            Its unit is 1/length for the signature function. It is about 1 for the offset model, and 0 where that
            has no answer.
    """

    query: int
    reason: FlagReason
    gradient_norm: float
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        query = self.query

        reason = self.reason.value

        gradient_norm = self.gradient_norm

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "query": query,
                "reason": reason,
                "gradient_norm": gradient_norm,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        query = d.pop("query")

        reason = FlagReason(d.pop("reason"))

        gradient_norm = d.pop("gradient_norm")

        flag = cls(
            query=query,
            reason=reason,
            gradient_norm=gradient_norm,
        )

        flag.additional_properties = d
        return flag

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
