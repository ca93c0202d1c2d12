"""Files of answers, by the endings of their names."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from .files import replace_file
from .ply import ply_of
from .table import Table
from .vtp import vtp_of


def save(path: str | os.PathLike[str], writers: dict[str, Callable[[], bytes]]) -> None:
    """Writes a file by the writer for the ending of its name. An older file is replaced once the new one is whole.

    Raises
    ------
    ValueError
        If there is no writer for the ending.
    """
    name = os.fspath(path)
    ending = os.path.splitext(name)[1].lower()  # noqa: PTH122 (the path may be of any kind)
    if ending not in writers:
        raise ValueError(f"the name of this file ends with {_listed(list(writers))}, not as {name!r} does")
    replace_file(path, writers[ending]())


def writers_of(table: Callable[[], Table]) -> dict[str, Callable[[], bytes]]:
    """Returns the writers of tables by ending."""
    return {
        ".ply": lambda: ply_of(table()),
        ".vtp": lambda: vtp_of(table()),
        ".csv": lambda: csv_of(table()),
    }


def csv_of(table: Table) -> bytes:
    """Returns a table with a column for each number, in shortest notation that reads back unchanged."""
    columns = {**table.columns(), **table.texts()}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    return text.getvalue().encode()


def npz_of(answer: Any, arrays: dict[str, Any]) -> bytes:  # noqa: ANN401 (an Answer)
    """Returns arrays in their shapes, with the flags, and with the diagnostics as text in JSON."""
    flags = getattr(answer, "flags", ())
    content: dict[str, Any] = {
        **arrays,
        "flag_query": [flag.query for flag in flags],
        "flag_reason": [flag.reason.value for flag in flags],
        **({"diagnostics": json.dumps(answer.diagnostics.to_dict())} if hasattr(answer, "diagnostics") else {}),
    }
    file = io.BytesIO()
    np.savez(file, **content)
    return file.getvalue()


def _listed(endings: list[str]) -> str:
    return f"{', '.join(endings[:-1])} or {endings[-1]}" if len(endings) > 1 else endings[0]
