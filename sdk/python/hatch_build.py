"""Metadata of the pure wheel: what the wheel with the program has, and the version of the program."""

import tomllib
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

ROOT = Path(__file__).resolve().parents[2]


class RootMetadata(MetadataHookInterface):
    """Takes what is dynamic here from the files in the root."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Fills the fields in."""
        project = read("pyproject.toml")["project"]
        project["version"] = read("Cargo.toml")["workspace"]["package"]["version"]
        metadata.update({name: project[name] for name in metadata["dynamic"]})


def read(name: str) -> dict[str, Any]:
    """Reads a TOML file in the root."""
    return tomllib.loads((ROOT / name).read_text())
