"""Clouds in files of other programs. docs/formats.md has the formats, and what is read of each.

The subcommands of the program and its page read the same formats. `tests/clouds` and `tests/tables` of the
repository hold the three to the same outcomes.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from .arrays import read_json, read_npy
from .columns import FileCloud
from .formats import FORMATS, format_of
from .las import read_las
from .meshes import read_obj, read_stl
from .pcd import read_pcd
from .ply import read_ply
from .rows import read_rows

__all__ = ["FORMATS", "FileCloud", "parse", "read"]

READERS: dict[str, Callable[[bytes], FileCloud]] = {
    "PLY": read_ply,
    "XYZ, CSV, TSV": read_rows,
    "PCD": read_pcd,
    "LAS, LAZ": read_las,
    "npy": read_npy,
    "OBJ": read_obj,
    "STL": read_stl,
    "JSON": read_json,
}


def read(path: str | os.PathLike[str]) -> FileCloud:
    """Reads a cloud by the content of its file, or where that decides nothing, by the ending of its name.

    Raises
    ------
    OSError
        If the file cannot be opened.
    ValueError
        If its content cannot be read: says in which line or at which point, and what is wrong.
    """
    name = os.fspath(path)
    content = Path(name).read_bytes()
    try:
        return parse(name, content)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def parse(name: str, content: bytes) -> FileCloud:
    """Reads a cloud from the bytes of a file. Its name has the ending.

    Raises
    ------
    ValueError
        If the content cannot be read.
    """
    return READERS[format_of(name, content)](content)
