"""PLY, ascii and binary of both byte orders. Elements other than vertices, and lists, are skipped."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from .columns import Columns, FileCloud
from .records import columns_of, ends_early, lines_of, number_of, text_columns

MAX_HEADER_BYTES = 65536
"""The longest header in bytes, as the service has it."""

TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
"""Types of NumPy by their names in PLY."""

CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
"""Types of `struct` by those of NumPy."""

ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class Property:
    """A number of a record, or a list with the type of its length."""

    name: str
    kind: str
    length: str | None = None


@dataclass
class Element:
    """A group of records with the same properties."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def numbers(self) -> list[str]:
        """Names of the properties that are no lists."""
        return [known.name for known in self.properties if known.length is None]


@dataclass
class Header:
    """A parsed header, with the elements in the order of the file."""

    order: str
    elements: list[Element]
    n_bytes: int
    n_lines: int


def read_ply(content: bytes) -> FileCloud:
    """Reads the vertices with all properties that are numbers.

    Raises
    ------
    ValueError
        If the file is damaged, or has no vertices with positions.
    """
    header = _header(content)
    names = [element.name for element in header.elements]
    if "vertex" not in names:
        raise ValueError("the file has no element vertex")
    at = names.index("vertex")
    before, vertices = header.elements[:at], header.elements[at]
    if not vertices.numbers:
        raise ValueError("the element vertex has no scalar properties")
    data = content[header.n_bytes :]
    if header.order == "":
        return _text_vertices(lines_of(data, header.n_lines), before, vertices).cloud()
    records = _Binary(data, header.order)
    for element in before:
        records.skip(element)
    return records.vertices(vertices).cloud()


def _header(content: bytes) -> Header:
    head = content[:MAX_HEADER_BYTES]
    order: str | None = None
    elements: list[Element] = []
    n_bytes = n_lines = 0
    while True:
        end = head.find(b"\n", n_bytes)
        if end < 0:
            said = f'there is no line "end_header" in its first {MAX_HEADER_BYTES} bytes'
            raise ValueError(f"the header does not end: {said}")
        line = head[n_bytes:end].removesuffix(b"\r").decode("utf-8", "replace")
        n_bytes, n_lines = end + 1, n_lines + 1
        if n_lines == 1 or line.startswith(("comment", "obj_info")):
            continue
        words = line.split()
        if words == ["end_header"]:
            break
        try:
            order = _read_line(line, order, elements)
        except ValueError as error:
            raise ValueError(f"line {n_lines} of the header: {error}") from None
    if order is None:
        raise ValueError('line 2 of the header: there is no line "format"')
    return Header(order, elements, n_bytes, n_lines)


def _read_line(line: str, order: str | None, elements: list[Element]) -> str | None:
    """Reads a line of the header. Returns the byte order, which may be that of this line."""
    match line.split():
        case ["format", *_] if order is not None:
            raise ValueError("the format is given twice")
        case ["format", name, version]:
            if name not in ORDERS or version != "1.0":
                known = "ascii, binary_little_endian and binary_big_endian 1.0"
                raise ValueError(f'format "{f"{name} {version}"[:40]}" is none of {known}')
            return ORDERS[name]
        case ["element", name, count]:
            if any(element.name == name for element in elements):
                raise ValueError(f'a second element "{name[:40]}"')
            if not (count.isascii() and count.isdigit()):
                raise ValueError(f'element "{name[:40]}" has an impossible count')
            elements.append(Element(name, int(count)))
        case ["property", *words]:
            if not elements:
                raise ValueError("it belongs to no element")
            added = _property(words)
            if any(known.name == added.name for known in elements[-1].properties):
                raise ValueError(f'a second property "{added.name[:40]}"')
            elements[-1].properties.append(added)
        case _:
            raise ValueError(f'"{line[:40]}" is no line of a header')
    return order


def _property(words: list[str]) -> Property:
    match words:
        case ["list", length, entry, name]:
            found = Property(name, _type(entry), _type(length))
            if found.length in {"f4", "f8"}:
                raise ValueError("the length of a list is a whole number")
            return found
        case [kind, name]:
            return Property(name, _type(kind))
    raise ValueError("a property has a type and a name")


def _type(name: str) -> str:
    if name not in TYPES:
        raise ValueError(f'"{name[:40]}" is no type of PLY')
    return TYPES[name]


def _text_vertices(lines: Iterator[tuple[int, list[str]]], before: list[Element], vertices: Element) -> Columns:
    """Reads vertices in text, a line each."""
    for element in before:
        for index in range(element.count if element.properties else 0):
            if next(lines, None) is None:
                raise ends_early(element.name, index, element.count)
    rows: list[list[float]] = []
    numbers: list[int] = []
    for index in range(vertices.count):
        number, words = next(lines, (0, []))
        if number == 0:
            raise ends_early(vertices.name, index, vertices.count)
        rows.append(_text_record(words, vertices, number))
        numbers.append(number)
    return text_columns(vertices.numbers, rows, numbers)


def _text_record(words: list[str], element: Element, line: int) -> list[float]:
    found: list[float] = []
    at = 0
    for known in element.properties:
        if at >= len(words):
            raise ValueError(f"line {line}: there are too few numbers")
        word = words[at]
        at += 1
        if known.length is None:
            found.append(number_of(word, line))
        elif word.isascii() and word.isdigit():
            at += int(word)
        else:
            raise ValueError(f'line {line}: "{word[:40]}" is no length of a list')
    if at > len(words):
        raise ValueError(f"line {line}: there are too few numbers")
    if at < len(words):
        raise ValueError(f"line {line}: there are more numbers than the header announces")
    return found


class _Binary:
    """Binary records, read one after another."""

    def __init__(self, data: bytes, order: str) -> None:
        self.data = data
        self.order = order
        self.at = 0

    def skip(self, element: Element) -> None:
        width = self._check_room(element)
        if len(element.numbers) == len(element.properties):
            self.at += width * element.count
            return
        for index in range(element.count):
            self._record(element, index, lambda _: None)

    def vertices(self, element: Element) -> Columns:
        self._check_room(element)
        if len(element.numbers) == len(element.properties):
            dtype = [(known.name, self.order + known.kind) for known in element.properties]
            return columns_of(self.data[self.at :], element.count, dtype, element.name)
        rows: list[float] = []
        for index in range(element.count):
            self._record(element, index, rows.append)
        columns = text_columns(element.numbers, np.array(rows).reshape(element.count, -1).tolist(), [])
        return Columns(columns.numbers, record=element.name)

    def _check_room(self, element: Element) -> int:
        """Refuses a count for which there are too few bytes. Returns the fewest bytes of a record."""
        width = sum(np.dtype(known.length or known.kind).itemsize for known in element.properties)
        room = (len(self.data) - self.at) // width if width > 0 else element.count
        if element.count > room:
            raise ends_early(element.name, room, element.count)
        return width

    def _record(self, element: Element, index: int, take: Callable[[float], None]) -> None:
        for known in element.properties:
            kind = self.order + CODES[known.length or known.kind]
            size = struct.calcsize(kind)
            if self.at + size > len(self.data):
                raise ends_early(element.name, index, element.count)
            (value,) = struct.unpack_from(kind, self.data, self.at)
            self.at += size
            if known.length is None:
                take(float(value))
                continue
            if value < 0:
                raise ValueError(f"{element.name} {index + 1}: a list has {value} entries")
            self.at += value * np.dtype(known.kind).itemsize
            if self.at > len(self.data):
                raise ends_early(element.name, index, element.count)
