"""Arrays of NumPy and JSON: rows of coordinates."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import numpy as np
from numpy.lib import format as npy

from ...wire.tensors import Array
from .columns import POSITIONS, Columns, FileCloud
from .records import ends_early

DTYPES = ["<f8", ">f8", "<f4", ">f4"]

MAX_HEADER_BYTES = 65536


def read_npy(content: bytes) -> FileCloud:
    """Reads an array `[n, d]` of either order, width and byte order.

    Raises
    ------
    ValueError
        If the file is damaged, or has another shape or type.
    """
    file = io.BytesIO(content)
    try:
        version = npy.read_magic(file)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, is_fortran, dtype = read_header(file, max_header_size=MAX_HEADER_BYTES)
    except Exception as error:  # of NumPy's parser, which evaluates the header as Python
        raise ValueError("the header of the npy file is damaged") from error
    if dtype.str not in DTYPES:
        kind = "of several fields" if dtype.names else dtype.str
        raise ValueError(f"the array has dtype '{kind}', not '<f8' or '<f4'")
    if len(shape) != 2:
        raise ValueError(f"the array has the shape ({', '.join(map(str, shape))}), not [n, d]")
    n, d = shape
    if n == 0 or d == 0:
        raise ValueError("the file has no points")
    n_there = (len(content) - file.tell()) // dtype.itemsize
    if n * d > n_there:
        raise ends_early("point", 0 if is_fortran else n_there // d, n)
    numbers = np.frombuffer(content, dtype, n * d, file.tell())
    points: Array = numbers.reshape((n, d), order="F" if is_fortran else "C").astype(np.float64, order="C")
    names = POSITIONS[:d] if d <= len(POSITIONS) else [f"coordinate {axis + 1}" for axis in range(d)]
    Columns({name: points[:, axis] for axis, name in enumerate(names)}).check_finite(names)
    return FileCloud(points)


def read_json(content: bytes) -> FileCloud:
    """Reads rows of coordinates, alone or as `points`, which may stand in `cloud` as in a request.

    Raises
    ------
    ValueError
        If the file is not JSON, or has no rows of numbers.
    """
    text = text_of(content)
    try:
        document = json.loads(text, parse_int=float)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"the file is not JSON: {error}") from error
    cloud = _member(document, "cloud", document)
    points = cloud if isinstance(cloud, list) else _member(cloud, "points")
    d = len(points[0]) if isinstance(points, list) and points and isinstance(points[0], list) else 0
    if d == 0:
        raise ValueError("the JSON needs points: rows of coordinates")
    normals = _member(cloud, "normals")
    if normals is not None and (not isinstance(normals, list) or len(normals) != len(points)):
        raise ValueError(f"normals must have one row for each of the {len(points)} points")
    values = _member(cloud, "values", _member(document, "values"))
    return FileCloud(
        _table("points", points, d),
        None if normals is None else _table("normals", normals, d),
        {} if values is None else {"values": np.array(_numbers("values", values, len(points)))},
    )


def text_of(content: bytes) -> str:
    """Returns the text of a file, without the mark that spreadsheets put before it.

    Raises
    ------
    ValueError
        If it is not UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError("the file is not UTF-8: save it in that encoding") from error


def _member(document: Any, name: str, default: Any = None) -> Any:  # noqa: ANN401
    found = document.get(name) if isinstance(document, dict) else None
    return default if found is None else found


def _table(member: str, rows: list[Any], d: int) -> Array:
    return np.array([_numbers(f"{member}[{at}]", row, d) for at, row in enumerate(rows)])


def _numbers(member: str, row: object, n: int) -> list[float]:
    if isinstance(row, list) and len(row) == n and all(isinstance(x, float) and math.isfinite(x) for x in row):
        return row
    raise ValueError(f"{member} is not a row of {n} numbers")
