from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.kernel_family import KernelFamily
from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="FamilyScore")


@_attrs_define
class FamilyScore:
    """The best score of a family.

    Attributes:
        family (KernelFamily): The families of kernels. `GET /v1/kernels` has their formulas.
        nu (float | Unset): The smoothness ν of the Matérn family. Absent for other families.
        score (float | None | Unset): The best score of the family. Null if the matrix was not positive definite from
            any start.
    """

    family: KernelFamily
    nu: float | Unset = UNSET
    score: float | None | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        family = self.family.value

        nu = self.nu

        score: float | None | Unset
        if isinstance(self.score, Unset):
            score = UNSET
        else:
            score = self.score

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "family": family,
            }
        )
        if nu is not UNSET:
            field_dict["nu"] = nu
        if score is not UNSET:
            field_dict["score"] = score

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        family = KernelFamily(d.pop("family"))

        nu = d.pop("nu", UNSET)

        def _parse_score(data: object) -> float | None | Unset:
            if data is None:
                return data
            if isinstance(data, Unset):
                return data
            return cast(float | None | Unset, data)

        score = _parse_score(d.pop("score", UNSET))

        family_score = cls(
            family=family,
            nu=nu,
            score=score,
        )

        family_score.additional_properties = d
        return family_score

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
