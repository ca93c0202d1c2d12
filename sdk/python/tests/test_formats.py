"""Files of points as the package reads them, held to the files and outcomes of the repository.

The readers of the subcommands and of the page are held to the same ones.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gramian.arguments.files import FORMATS, FileCloud, parse, read

REPOSITORY = Path(__file__).resolve().parents[3]

READER = "python"
"""The name of the reader in outcomes that differ among readers."""

OTHERS = {"expected.json", "make_samples"}

FOLDERS = [REPOSITORY / "tests" / kind for kind in ("tables", "clouds")]

OUTCOMES = {
    folder / name: outcome.get(READER, outcome)
    for folder in FOLDERS
    for name, outcome in json.loads((folder / "expected.json").read_text()).items()
}


def outcome_of(cloud: FileCloud) -> dict[str, Any]:
    """A cloud in the form of expected.json, where None is a value that is missing or infinite."""
    found: dict[str, Any] = {"points": cloud.positions.tolist()}
    if cloud.normals is not None:
        found["normals"] = cloud.normals.tolist()
    if cloud.colours is not None:
        found["colours"] = cloud.colours.tolist()
    if cloud.columns:
        found["values"] = {
            name: [x if np.isfinite(x) else None for x in column.tolist()] for name, column in cloud.columns.items()
        }
    if cloud.left_out is not None:
        found["left_out"] = cloud.left_out
    return found


def test_every_sample_has_an_outcome() -> None:
    samples = {path for folder in FOLDERS for path in folder.iterdir() if path.name not in OTHERS}
    assert samples == set(OUTCOMES)


@pytest.mark.parametrize("path", OUTCOMES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_files_are_read_as_by_others(path: Path) -> None:
    expected = OUTCOMES[path]
    if "refused" not in expected:
        assert outcome_of(read(path)) == expected
        return
    sentence: str = expected["refused"]
    pattern = re.escape(sentence.removesuffix("…")) + ("" if sentence.endswith("…") else "$")
    with pytest.raises(ValueError, match="^" + pattern):
        parse(path.name, path.read_bytes())
    with pytest.raises(ValueError, match="^" + re.escape(f"{path}: ")):
        read(str(path))


def test_files_that_end_anywhere_or_have_a_wrong_byte_are_read_or_refused() -> None:
    for path in OUTCOMES:
        whole = path.read_bytes()
        for at in range(len(whole)):
            flipped = whole[:at] + bytes([whole[at] ^ 0x80]) + whole[at + 1 :]
            for damaged in (whole[:at], flipped):
                try:
                    cloud = parse(path.name, damaged)
                except ValueError:
                    continue
                assert np.isfinite(cloud.positions).all(), path.name


def test_the_formats_are_those_of_the_documents() -> None:
    text = (REPOSITORY / "docs/formats.md").read_text()
    rows = re.findall(r"^\| ([^|]+) \| (`\.[^|]+) \|", text, re.MULTILINE)
    assert {name: re.sub(r"[`.]", "", endings).split(", ") for name, endings in rows} == FORMATS
