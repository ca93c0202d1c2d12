from __future__ import annotations

import datetime
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.job_status import JobStatus
from ..types import UNSET, Unset, without_unset

if TYPE_CHECKING:
    from ..models.job_progress import JobProgress
    from ..models.problem import Problem


T = TypeVar("T", bound="Job")


@_attrs_define
class Job:
    """A job.

    Attributes:
        job_id (str): The id of a job: a UUID of version 7, in lower case.
        status (JobStatus): The state of a job.
        progress (JobProgress): The progress of a job.
        created_at (datetime.datetime): The time at which the job was requested, in UTC.
        ended_at (datetime.datetime | Unset): The time at which the job ended, in UTC. Absent before.
        expires_at (datetime.datetime | Unset): The time until which the result is kept, in UTC. Absent before there is
            a result.
        problem (Problem | Unset): A problem document (RFC 9457, `application/problem+json`).
    """

    job_id: str
    status: JobStatus
    progress: JobProgress
    created_at: datetime.datetime
    ended_at: datetime.datetime | Unset = UNSET
    expires_at: datetime.datetime | Unset = UNSET
    problem: Problem | Unset = UNSET
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        job_id = self.job_id

        status = self.status.value

        progress = self.progress.to_dict()

        created_at = self.created_at.isoformat()

        ended_at: str | Unset = UNSET
        if not isinstance(self.ended_at, Unset):
            ended_at = self.ended_at.isoformat()

        expires_at: str | Unset = UNSET
        if not isinstance(self.expires_at, Unset):
            expires_at = self.expires_at.isoformat()

        problem: dict[str, Any] | Unset = UNSET
        if not isinstance(self.problem, Unset):
            problem = self.problem.to_dict()

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "job_id": job_id,
                "status": status,
                "progress": progress,
                "created_at": created_at,
            }
        )
        if ended_at is not UNSET:
            field_dict["ended_at"] = ended_at
        if expires_at is not UNSET:
            field_dict["expires_at"] = expires_at
        if problem is not UNSET:
            field_dict["problem"] = problem

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        from ..models.job_progress import JobProgress
        from ..models.problem import Problem

        d = dict(src_dict)
        job_id = d.pop("job_id")

        status = JobStatus(d.pop("status"))

        progress = JobProgress.from_dict(d.pop("progress"))

        created_at = datetime.datetime.fromisoformat(d.pop("created_at"))

        _ended_at = d.pop("ended_at", UNSET)
        ended_at: datetime.datetime | Unset
        if isinstance(_ended_at, Unset):
            ended_at = UNSET
        else:
            ended_at = datetime.datetime.fromisoformat(_ended_at)

        _expires_at = d.pop("expires_at", UNSET)
        expires_at: datetime.datetime | Unset
        if isinstance(_expires_at, Unset):
            expires_at = UNSET
        else:
            expires_at = datetime.datetime.fromisoformat(_expires_at)

        _problem = d.pop("problem", UNSET)
        problem: Problem | Unset
        if isinstance(_problem, Unset):
            problem = UNSET
        else:
            problem = Problem.from_dict(_problem)

        job = cls(
            job_id=job_id,
            status=status,
            progress=progress,
            created_at=created_at,
            ended_at=ended_at,
            expires_at=expires_at,
            problem=problem,
        )

        job.additional_properties = d
        return job

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
