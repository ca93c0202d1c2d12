from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.operation_name import OperationName
from ..types import without_unset

T = TypeVar("T", bound="EstimateRequest")


@_attrs_define
class EstimateRequest:
    """The members of a request of this operation, and `operation` beside them: see the schema of that request.

    Attributes:
        operation (OperationName): An operation that computes, by its `operationId`.
    """

    operation: OperationName
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        operation = self.operation.value

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "operation": operation,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        operation = OperationName(d.pop("operation"))

        estimate_request = cls(
            operation=operation,
        )

        estimate_request.additional_properties = d
        return estimate_request

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
