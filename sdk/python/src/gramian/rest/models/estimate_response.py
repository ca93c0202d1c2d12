from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..models.solver_used import SolverUsed
from ..types import without_unset

T = TypeVar("T", bound="EstimateResponse")


@_attrs_define
class EstimateResponse:
    """The expected cost of a request.

    Attributes:
        operation (str): The operation, repeated.
        solver (SolverUsed): The solver that was used.
        flops (float): Number of floating-point operations, counted beforehand.
        bytes_ (int): Memory that the request would need beside what is held already, bytes.
        seconds (float): Expected seconds from the request's turn in the queue to its answer.

            They are learned from what ran on this machine since the server started.
        cached (bool): True if all factorizations that the request needs are there.
        admissible (bool): True if memory and time suffice for the request when nothing else runs.
    """

    operation: str
    solver: SolverUsed
    flops: float
    bytes_: int
    seconds: float
    cached: bool
    admissible: bool
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        operation = self.operation

        solver = self.solver.value

        flops = self.flops

        bytes_ = self.bytes_

        seconds = self.seconds

        cached = self.cached

        admissible = self.admissible

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "operation": operation,
                "solver": solver,
                "flops": flops,
                "bytes": bytes_,
                "seconds": seconds,
                "cached": cached,
                "admissible": admissible,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        operation = d.pop("operation")

        solver = SolverUsed(d.pop("solver"))

        flops = d.pop("flops")

        bytes_ = d.pop("bytes")

        seconds = d.pop("seconds")

        cached = d.pop("cached")

        admissible = d.pop("admissible")

        estimate_response = cls(
            operation=operation,
            solver=solver,
            flops=flops,
            bytes_=bytes_,
            seconds=seconds,
            cached=cached,
            admissible=admissible,
        )

        estimate_response.additional_properties = d
        return estimate_response

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
