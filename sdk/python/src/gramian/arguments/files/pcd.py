"""PCD, the format of the Point Cloud Library, in its three encodings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...wire.tensors import Array
from .columns import Columns, FileCloud
from .records import columns_of, ends_early, lines_of, number_of, text_columns

MAX_HEADER_BYTES = 65536

MAX_FIELDS = 4096
"""The most numbers of a point: the largest descriptors have some hundreds."""

MAX_COPY = 264
"""The most bytes that compressed ones stand for, each."""

PADDING = "_"
"""The name of fields that fill a point up to a round size."""

TYPES = {
    "I1": "<i1",
    "I2": "<i2",
    "I4": "<i4",
    "I8": "<i8",
    "U1": "<u1",
    "U2": "<u2",
    "U4": "<u4",
    "U8": "<u8",
    "F4": "<f4",
    "F8": "<f8",
}


@dataclass
class Field:
    """A field of a point, of `count` numbers."""

    name: str
    dtype: str
    count: int

    @property
    def width(self) -> int:
        """Bytes of the field in a point."""
        return np.dtype(self.dtype).itemsize * self.count


@dataclass
class Header:
    """What the first lines say."""

    fields: list[Field]
    n_points: int
    encoding: str
    n_bytes: int
    n_lines: int

    @property
    def width(self) -> int:
        """Bytes of a point."""
        return sum(field.width for field in self.fields)

    @property
    def numbers(self) -> list[tuple[str, str]]:
        """Name and type of every number of a point. Numbers of one field are counted from 0."""
        found: list[tuple[str, str]] = []
        for at, field in enumerate(self.fields):
            # Padding has names of its own until it is dropped.
            name = f"__{at}" if field.name == PADDING else field.name
            names = [name] if field.count == 1 else [f"{name}_{index}" for index in range(field.count)]
            found += [(own, field.dtype) for own in names]
        return found


def read_pcd(content: bytes) -> FileCloud:
    """Reads the points. Those without a position are left out.

    Raises
    ------
    ValueError
        If the file is damaged, or has no positions.
    """
    header = _header(content)
    body = content[header.n_bytes :]
    if header.encoding == "ascii":
        columns = _text_rows(body, header)
    elif header.encoding == "binary":
        columns = columns_of(body, header.n_points, header.numbers, "point")
    elif header.encoding == "binary_compressed":
        columns = columns_of(_unpacked(body, header), header.n_points, header.numbers, "point")
    else:
        raise ValueError(f'DATA is "{header.encoding}", not ascii, binary or binary_compressed')
    return _with_colours(columns, header).cloud(has_gaps=True)


def _header(content: bytes) -> Header:
    entries: dict[str, list[str]] = {}
    n_bytes = n_lines = 0
    for line in content[:MAX_HEADER_BYTES].splitlines(keepends=True):
        n_bytes, n_lines = n_bytes + len(line), n_lines + 1
        keyword, *words = line.decode("latin-1").split() or ["#"]
        if keyword.startswith("#"):
            continue
        entries.setdefault(keyword, words)
        if keyword == "DATA":
            break
    encoding = next(iter(entries.get("DATA", [])), None)
    if encoding is None:
        raise ValueError("the header does not end: it has no line DATA")
    names = entries.get("FIELDS") or entries.get("COLUMNS")
    if not names:
        raise ValueError("the header has no line FIELDS")
    fields = [_field(name, at, entries) for at, name in enumerate(names)]
    twice = next((name for at, name in enumerate(names) if name != PADDING and name in names[:at]), None)
    n_points = _n_points(entries)
    if twice is not None:
        raise ValueError(f"the header names {twice} twice")
    if sum(field.count for field in fields) > MAX_FIELDS:
        raise ValueError(f"a point has more than {MAX_FIELDS} numbers")
    return Header(fields, n_points, encoding, n_bytes, n_lines)


def _field(name: str, at: int, entries: dict[str, list[str]]) -> Field:
    word = {entry: words[at] for entry, words in entries.items() if at < len(words)}
    kind = word.get("TYPE", "") + word.get("SIZE", "")
    if kind not in TYPES:
        raise ValueError(f"the type of {name}, {kind}, is unknown")
    count = _whole(word.get("COUNT", "1"))
    if count is None or not 1 <= count <= MAX_FIELDS:
        raise ValueError(f"COUNT of {name} is not a count")
    return Field(name, TYPES[kind], count)


def _n_points(entries: dict[str, list[str]]) -> int:
    first = {entry: _whole(words[0]) for entry, words in entries.items() if words}
    points, width, height = (first.get(entry) for entry in ("POINTS", "WIDTH", "HEIGHT"))
    if points is None and width is not None and height is not None:
        points = width * height
    if points is None:
        raise ValueError("the header has no number of points")
    return points


def _whole(word: str) -> int | None:
    return int(word) if word.isascii() and word.isdigit() else None


def _text_rows(body: bytes, header: Header) -> Columns:
    names = [name for name, _ in header.numbers]
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, words in lines_of(body, header.n_lines):
        if len(rows) == header.n_points:
            break
        if len(words) != len(names):
            announced = f"but the header announces {len(names)} columns"
            raise ValueError(f"line {number}: {len(words)} numbers, {announced}")
        rows.append([number_of(word, number) for word in words])
        lines.append(number)
    if len(rows) < header.n_points:
        raise ends_early("point", len(rows), header.n_points)
    return text_columns(names, rows, lines)


def _unpacked(body: bytes, header: Header) -> bytes:
    """Returns the points of a compressed body, one after another.

    The body has all numbers of the first field, then all of the second, and so on, after its sizes with and
    without compression.
    """
    if len(body) < 8:
        raise ValueError("the file ends before its compressed points")
    n_packed, n_whole = (int.from_bytes(body[at : at + 4], "little") for at in (0, 4))
    if len(body) - 8 < n_packed:
        raise ValueError(f"the file ends at byte {len(body) - 8} of {n_packed} of its compressed points")
    n, width = header.n_points, header.width
    if n * width != n_whole:
        raise ValueError(f"{n_whole} bytes are not those of {n} points with {width} bytes each")
    whole = decompressed(body[8 : 8 + n_packed], n_whole)
    if whole is None:
        raise ValueError("the compressed points are damaged")
    fields: list[npt.NDArray[np.uint8]] = []
    begins = 0
    for field in header.fields:
        fields.append(np.frombuffer(whole, np.uint8, n * field.width, begins).reshape(n, field.width))
        begins += n * field.width
    return np.hstack(fields).tobytes()


def decompressed(packed: bytes, size: int) -> bytes | None:
    """Decompresses LZF to exactly `size` bytes. None if the bytes do not have that size, or are damaged.

    LZF has runs of bytes as they are, and copies of earlier ones.
    """
    if size > len(packed) * MAX_COPY:
        return None
    whole = bytearray()
    at = 0
    while at < len(packed) and len(whole) <= size:
        control = packed[at]
        at += 1
        if control < 32:
            run = packed[at : at + control + 1]
            if len(run) <= control:
                return None
            whole += run
            at += control + 1
            continue
        length = (control >> 5) + 2
        n_more = 2 if length == 9 else 1
        if at + n_more > len(packed):
            return None
        if length == 9:
            length += packed[at]
        begins = len(whole) - ((control & 0x1F) << 8) - packed[at + n_more - 1] - 1
        at += n_more
        if begins < 0:
            return None
        # A copy may run into what it writes: then it repeats what is there.
        copied = whole[begins : begins + length]
        whole += (copied * -(-length // len(copied)))[:length]
    return bytes(whole) if len(whole) == size else None


def _with_colours(columns: Columns, header: Header) -> Columns:
    """Replaces packed colours by three columns, and drops what fills points up."""
    unpacked: dict[str, Array] = {}
    for name, dtype in header.numbers:
        column = columns.numbers[name]
        if name in {"rgb", "rgba"} and np.dtype(dtype).itemsize == 4:
            bits = _bits(column, dtype)
            for colour, shift in [("red", 16), ("green", 8), ("blue", 0)]:
                unpacked[colour] = (bits >> shift & 0xFF).astype(np.float64)
        elif not name.startswith("__"):
            unpacked[name] = column
    return Columns(unpacked, columns.lines, columns.record)


def _bits(column: Array, dtype: str) -> npt.NDArray[np.uint32]:
    """Returns the bits of colours, which are often written as the float that has the same bits."""
    with np.errstate(all="ignore"):
        if dtype == TYPES["F4"]:
            return column.astype(np.float32).view(np.uint32)
        return np.nan_to_num(column).astype(np.int64).astype(np.uint32)
