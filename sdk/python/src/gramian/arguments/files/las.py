"""LAS 1.0 to 1.4 of the ASPRS. Points have whole numbers, which the header scales and moves."""

from __future__ import annotations

import importlib
import io
import struct
from dataclasses import dataclass

import numpy as np

from ...wire.tensors import Array
from .columns import POSITIONS, Columns, FileCloud
from .records import columns_of

MIN_HEADER_BYTES = 227
"""Bytes of the shortest header, of LAS 1.0 to 1.2."""

COMPRESSED = 0xC0
"""Bits of the point format that say that points are compressed."""

POINT_BYTES = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67]
"""Bytes of a point without extra bytes, by format."""

FIRST_OF_1_4 = 6
"""The first format of LAS 1.4, whose bits are elsewhere."""

COLOURS = {2: 20, 3: 28, 5: 28, 7: 30, 8: 30, 10: 30}
"""Where colours are in a point, by format."""


@dataclass
class Header:
    """What is read of the header of a file."""

    begins: int
    format: int
    is_compressed: bool
    width: int
    count: int
    scales: tuple[float, ...]
    offsets: tuple[float, ...]

    @property
    def is_new(self) -> bool:
        """Whether bits are where LAS 1.4 places them."""
        return self.format >= FIRST_OF_1_4

    def fields(self) -> list[tuple[str, str, int]]:
        """Returns names, types and offsets of the numbers of a point, as LAS places them by format."""
        fields = [("x", "<i4", 0), ("y", "<i4", 4), ("z", "<i4", 8), ("intensity", "<u2", 12), ("returns", "u1", 14)]
        if self.is_new:
            fields += [("classification", "u1", 16), ("user_data", "u1", 17), ("scan_angle", "<i2", 18)]
            fields += [("point_source_id", "<u2", 20), ("gps_time", "<f8", 22)]
        else:
            fields += [("classification", "u1", 15), ("scan_angle_rank", "i1", 16), ("user_data", "u1", 17)]
            fields += [("point_source_id", "<u2", 18)]
        if self.format in {1, 3, 4, 5}:
            fields += [("gps_time", "<f8", 20)]
        if self.format in COLOURS:
            at = COLOURS[self.format]
            fields += [("red", "<u2", at), ("green", "<u2", at + 2), ("blue", "<u2", at + 4)]
        if self.format in {8, 10}:
            fields += [("nir", "<u2", 36)]
        return fields


def read_las(content: bytes) -> FileCloud:
    """Reads positions, colours, and what else was measured at the points. LAZ is decompressed by laspy.

    Raises
    ------
    ValueError
        If the file is damaged, or LAZ and there is no laspy.
    """
    header = _header(content)
    if header.is_compressed:
        return read_las(_decompressed(content))
    names, formats, offsets = zip(*header.fields(), strict=True)
    dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": header.width})
    columns = columns_of(content[header.begins :], header.count, dtype, "point")
    return _placed(columns, header).cloud()


def _header(content: bytes) -> Header:
    if len(content) < MIN_HEADER_BYTES:
        raise ValueError("the file ends within its header")
    major, minor, kind = content[24], content[25], content[104]
    if major != 1 or minor > 4:
        raise ValueError(f"LAS {major}.{minor} is not read, but 1.0 to 1.4 are")
    known = kind & ~COMPRESSED
    if known >= len(POINT_BYTES):
        raise ValueError(f"points of format {known} are not read, but 0 to 10 are")
    width, count = struct.unpack_from("<HI", content, 105)
    if width < POINT_BYTES[known]:
        least = POINT_BYTES[known]
        raise ValueError(f"points of format {known} have {least} bytes, but the header says {width}")
    scales, offsets = (struct.unpack_from("<3d", content, at) for at in (131, 155))
    if not np.isfinite([*scales, *offsets]).all() or 0 in scales:
        raise ValueError("the header has scales or offsets that are no numbers")
    # The old number is 0 if there are more points than it can count.
    if minor == 4 and len(content) >= 255:
        count = struct.unpack_from("<Q", content, 247)[0] or count
    (begins,) = struct.unpack_from("<I", content, 96)
    return Header(begins, known, bool(kind & COMPRESSED), width, count, scales, offsets)


def _placed(columns: Columns, header: Header) -> Columns:
    """Scales and moves coordinates, and takes bits apart."""
    bits = 4 if header.is_new else 3
    mask = (1 << bits) - 1
    placed: dict[str, Array] = {}
    for name, column in columns.numbers.items():
        if name in POSITIONS:
            axis = POSITIONS.index(name)
            placed[name] = column * header.scales[axis] + header.offsets[axis]
        elif name == "returns":
            returns = column.astype(np.uint8)
            placed["return_number"] = (returns & mask).astype(np.float64)
            placed["number_of_returns"] = (returns >> bits & mask).astype(np.float64)
        elif name == "classification" and not header.is_new:
            # The three bits above the class are flags.
            placed[name] = (column.astype(np.uint8) & 0x1F).astype(np.float64)
        else:
            placed[name] = column
    return Columns(placed, record=columns.record)


def _decompressed(content: bytes) -> bytes:
    """Returns a LAZ file as LAS."""
    try:
        laspy = importlib.import_module("laspy")
        file = laspy.read(io.BytesIO(content))
    except ImportError:
        raise ValueError("the file is LAZ, which laspy decompresses: pip install 'laspy[lazrs]'") from None
    except Exception as error:  # of laspy or its backends
        if "LazBackend" in str(error):
            raise ValueError("the file is LAZ, which needs a backend of laspy: pip install 'laspy[lazrs]'") from error
        raise ValueError(f"the compressed points are damaged: {error}") from error
    plain = io.BytesIO()
    file.write(plain, do_compress=False)
    return plain.getvalue()
