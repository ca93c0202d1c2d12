from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="JobProgress")


@_attrs_define
class JobProgress:
    """How far a job is.

    Attributes:
        stage (str): What is being done: `queued`, then the stages of `Server-Timing`: `parse`, `gram`, `factor`,
            `solve`, `evaluate`; `done` in the end.
        fraction (float): The part of the time it is expected to take that has gone by, from 0 to 1.
        residual (float | Unset): Of the last solve, relative; absent before there is one.
        seconds_left (float | Unset): Seconds until it is done, by what ran on this machine; absent while that is
            unknown.
    """

    stage: str
    fraction: float
    residual: float | Unset = UNSET
    seconds_left: float | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        stage = self.stage

        fraction = self.fraction

        residual = self.residual

        seconds_left = self.seconds_left

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "stage": stage,
                "fraction": fraction,
            }
        )
        if residual is not UNSET:
            field_dict["residual"] = residual
        if seconds_left is not UNSET:
            field_dict["seconds_left"] = seconds_left

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        stage = d.pop("stage")

        fraction = d.pop("fraction")

        residual = d.pop("residual", UNSET)

        seconds_left = d.pop("seconds_left", UNSET)

        job_progress = cls(
            stage=stage,
            fraction=fraction,
            residual=residual,
            seconds_left=seconds_left,
        )

        job_progress.additional_properties = d
        return job_progress

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
