from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.field_error import FieldError


T = TypeVar("T", bound="Problem")


@_attrs_define
class Problem:
    """A problem document (RFC 9457, `application/problem+json`).

    Attributes:
        type_ (str): The type of problem: `/problems/<slug>`, which is also served as a page. Example:
            /problems/invalid-request.
        title (str): The type of problem in words, the same for every occurrence.
        status (int): The HTTP status code of the response. Example: 422.
        detail (str): The specifics of this occurrence: what happened, where, and the remedy if there is one.
        instance (str): The id of the request, as in `X-Request-Id`.
        errors (list[FieldError] | Unset): The fields that were refused.
        minimum_alpha (float | Unset): An alpha for which the computation succeeds, unit of the values squared.
        point_indices (list[int] | Unset): The points in question, as positions in the cloud. At most the first 1,000.
        limit (int | Unset): The limit that was exceeded, in the unit that `detail` names.
        required (int | Unset): The size that the request would have needed, in the unit of `limit`.
    """

    type_: str
    title: str
    status: int
    detail: str
    instance: str
    errors: list[FieldError] | Unset = UNSET
    minimum_alpha: float | Unset = UNSET
    point_indices: list[int] | Unset = UNSET
    limit: int | Unset = UNSET
    required: int | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        type_ = self.type_

        title = self.title

        status = self.status

        detail = self.detail

        instance = self.instance

        errors: list[dict[str, Any]] | Unset = UNSET
        if not isinstance(self.errors, Unset):
            errors = []
            for errors_item_data in self.errors:
                errors_item = errors_item_data.to_dict()
                errors.append(errors_item)

        minimum_alpha = self.minimum_alpha

        point_indices: list[int] | Unset = UNSET
        if not isinstance(self.point_indices, Unset):
            point_indices = self.point_indices

        limit = self.limit

        required = self.required

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "type": type_,
                "title": title,
                "status": status,
                "detail": detail,
                "instance": instance,
            }
        )
        if errors is not UNSET:
            field_dict["errors"] = errors
        if minimum_alpha is not UNSET:
            field_dict["minimum_alpha"] = minimum_alpha
        if point_indices is not UNSET:
            field_dict["point_indices"] = point_indices
        if limit is not UNSET:
            field_dict["limit"] = limit
        if required is not UNSET:
            field_dict["required"] = required

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.field_error import FieldError

        d = dict(src_dict)
        type_ = d.pop("type")

        title = d.pop("title")

        status = d.pop("status")

        detail = d.pop("detail")

        instance = d.pop("instance")

        _errors = d.pop("errors", UNSET)
        errors: list[FieldError] | Unset = UNSET
        if _errors is not UNSET:
            errors = []
            for errors_item_data in _errors:
                errors_item = FieldError.from_dict(errors_item_data)

                errors.append(errors_item)

        minimum_alpha = d.pop("minimum_alpha", UNSET)

        point_indices = cast(list[int], d.pop("point_indices", UNSET))

        limit = d.pop("limit", UNSET)

        required = d.pop("required", UNSET)

        problem = cls(
            type_=type_,
            title=title,
            status=status,
            detail=detail,
            instance=instance,
            errors=errors,
            minimum_alpha=minimum_alpha,
            point_indices=point_indices,
            limit=limit,
            required=required,
        )

        problem.additional_properties = d
        return problem

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
