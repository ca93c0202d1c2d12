"""VTK XML PolyData, as ParaView, VisIt and PyVista read it: arrays in base64, so that the file is XML throughout."""

from __future__ import annotations

import base64
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from .table import Table

TYPES = {"<f8": "Float64", "<i8": "Int64", "|u1": "UInt8"}

SHAPES = {2: "Lines", 3: "Polys"}
"""Cells by their number of corners. Points alone are `Verts`."""


def vtp_of(table: Table) -> bytes:
    """Returns a file with all arrays of the points, and those of the cells between them."""
    places = table.in_space(".vtp")
    cells = np.arange(table.n_rows)[:, None] if table.cells is None else table.cells
    shape = SHAPES.get(cells.shape[1], "Verts")
    counts = " ".join(f'NumberOf{kind}="{len(cells) * (kind == shape)}"' for kind in ("Verts", "Lines", "Polys"))
    scalars = f" Scalars={quoteattr(table.quantity)}" if table.quantity in table.vectors() else ""
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            *(f"<!-- {line.replace('--', '-')} -->" for line in table.legend()),
            '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
            f'<PolyData><Piece NumberOfPoints="{table.n_rows}" {counts} NumberOfStrips="0">',
            f"<PointData{scalars}>",
            *(_array(name, array) for name, array in table.vectors().items()),
            "</PointData>",
            f"<Points>{_array('Points', places)}</Points>",
            f"<{shape}>",
            _array("connectivity", cells.ravel()),
            _array("offsets", np.arange(1, len(cells) + 1) * cells.shape[1]),
            f"</{shape}>",
            "</Piece></PolyData></VTKFile>",
            "",
        ]
    ).encode()


def _array(name: str, array: npt.NDArray[Any]) -> str:
    """Returns an array `[m, …]` as an element, its bytes after their number."""
    kind = "|u1" if array.dtype == np.uint8 else "<i8" if array.dtype.kind == "i" else "<f8"
    content = np.ascontiguousarray(array, dtype=kind)
    n_components = content.size // len(content) if len(content) else 1
    coded = base64.b64encode(np.uint64(content.nbytes).astype("<u8").tobytes() + content.tobytes()).decode()
    return (
        f'<DataArray type="{TYPES[kind]}" Name={quoteattr(name)} NumberOfComponents="{n_components}" '
        f'format="binary">{coded}</DataArray>'
    )
