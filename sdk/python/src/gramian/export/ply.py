"""PLY 1.0, binary little-endian (Turk 1994), as MeshLab, CloudCompare and Blender read it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..wire.tensors import Integers
from .table import Table

COLOURS = ("red", "green", "blue")


def ply_of(table: Table) -> bytes:
    """Returns a file with all numbers of the vertices, as doubles.

    `quality` repeats the quantity that the colours show, since MeshLab maps `quality` to colours.
    """
    vertices, (element, properties, cells) = _vertices(table), _cells(table.cells)
    kinds = {"f8": "double", "u1": "uchar"}
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        "comment gramian: unit of lengths is that of the points",
        *(f"comment {line}" for line in table.legend()),
        f"element vertex {table.n_rows}",
        *(f"property {kinds[vertices.dtype[name].str[1:]]} {name}" for name in vertices.dtype.names or ()),
        *([f"element {element} {len(cells)}", *properties] if element else []),
        "end_header\n",
    ]
    return "\n".join(lines).encode() + vertices.tobytes() + cells.tobytes()


def _vertices(table: Table) -> npt.NDArray[np.void]:
    columns: dict[str, npt.NDArray[Any]] = dict(zip("xyz", table.in_space(".ply").T, strict=True))
    columns |= table.columns()
    if "nx" in columns:
        columns.setdefault("nz", np.zeros(table.n_rows))
    if table.scalars is not None and table.colours is not None:
        columns |= {"quality": table.scalars, **dict(zip(COLOURS, table.colours.T, strict=True))}
    columns |= table.codes()
    types = [(name, "u1" if column.dtype == np.uint8 else "<f8") for name, column in columns.items()]
    vertices = np.empty(table.n_rows, dtype=types)
    for name, column in columns.items():
        vertices[name] = column
    return vertices


def _cells(cells: Integers | None) -> tuple[str, list[str], npt.NDArray[Any]]:
    """Returns the name, the properties and the records of the element of segments or triangles."""
    if cells is None:
        return "", [], np.empty(0)
    if cells.shape[1] == 2:
        return "edge", ["property int vertex1", "property int vertex2"], cells.astype("<i4")
    faces = np.empty(len(cells), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, cells
    return "face", ["property list uchar int vertex_indices"], faces
