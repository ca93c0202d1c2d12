from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import UNSET, Unset, without_unset

T = TypeVar("T", bound="JobProgress")


@_attrs_define
class JobProgress:
    """The progress of a job.

    Attributes:
        stage (str): The current stage: `queued`, `parse`, `gram`, `factor`, `solve`, `evaluate`, or `done` in the end.

            Stages from `parse` to `evaluate` are those of `Server-Timing`.
        fraction (float): The elapsed part of the time that the job is expected to take, from 0 to 1.
        residual (float | Unset): Relative residual of the last solve. Absent before there is one.
        seconds_left (float | Unset): Seconds until the job is done, predicted from what ran on this machine. Absent
            while unknown.
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
