from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar

from attrs import define as _attrs_define
from attrs import field as _attrs_field

from ..types import without_unset

T = TypeVar("T", bound="Version")


@_attrs_define
class Version:
    """The build that is running, and what it runs on.

    Attributes:
        name (str): The name of the service.
        version (str): The version of the service.
        api (str): The version of the interface.
        instruction_set (str): The instruction set of the kernel loops, chosen at start.
        threads (int): Number of compute threads.
    """

    name: str
    version: str
    api: str
    instruction_set: str
    threads: int
    additional_properties: dict[str, Any] = _attrs_field(init=False, factory=dict)

    __repr__ = without_unset

    def to_dict(self) -> dict[str, Any]:
        name = self.name

        version = self.version

        api = self.api

        instruction_set = self.instruction_set

        threads = self.threads

        field_dict: dict[str, Any] = {}
        field_dict.update(self.additional_properties)
        field_dict.update(
            {
                "name": name,
                "version": version,
                "api": api,
                "instruction_set": instruction_set,
                "threads": threads,
            }
        )

        return field_dict

    @classmethod
    def from_dict(cls, src_dict: Mapping[str, Any]) -> Self:
        d = dict(src_dict)
        name = d.pop("name")

        version = d.pop("version")

        api = d.pop("api")

        instruction_set = d.pop("instruction_set")

        threads = d.pop("threads")

        version = cls(
            name=name,
            version=version,
            api=api,
            instruction_set=instruction_set,
            threads=threads,
        )

        version.additional_properties = d
        return version

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
