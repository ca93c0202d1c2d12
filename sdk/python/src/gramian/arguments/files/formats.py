"""The formats of clouds: names, endings, and how a file shows which it has. Those of docs/formats.md."""

from __future__ import annotations

FORMATS = {
    "PLY": ["ply"],
    "XYZ, CSV, TSV": ["xyz", "csv", "tsv", "txt", "asc", "pts"],
    "PCD": ["pcd"],
    "LAS, LAZ": ["las", "laz"],
    "npy": ["npy"],
    "OBJ": ["obj"],
    "STL": ["stl"],
    "JSON": ["json"],
}
"""Endings of files by the name of their format."""

BEGINNINGS = [
    (b"ply\n", "PLY"),
    (b"ply\r\n", "PLY"),
    (b"\x93NUMPY", "npy"),
    (b"LASF", "LAS, LAZ"),
    (b"# .PCD", "PCD"),
]
"""Beginnings of files that decide which format they have."""

OBJ_WORDS = {b"v", b"vn", b"vt", b"o", b"g", b"mtllib"}

MAX_HEAD_BYTES = 4096
"""Bytes that decide which format a text has, comments of its head included."""


def format_of(name: str, content: bytes) -> str:
    """Returns the format of a file. Its ending decides where its content could be of several formats.

    Raises
    ------
    ValueError
        If the ending promises what the content is not, or the content is of no known format.
    """
    for beginning, found in BEGINNINGS:
        if content.startswith(beginning):
            return found
    head = content[:MAX_HEAD_BYTES]
    ending = name.rpartition(".")[2].lower() if "." in name else ""
    promised = next((known for known, endings in FORMATS.items() if ending in endings), None)
    word = _first_word(head)
    if word == b"VERSION":
        return "PCD"
    if promised in {"STL", "OBJ", "JSON"}:
        return str(promised)
    if promised == "PLY":
        raise ValueError('the file is not PLY: its first line is not "ply"')
    if promised is not None and promised != "XYZ, CSV, TSV":
        raise ValueError(f"the file is not {promised}: its first bytes are not those of this format")
    if word in OBJ_WORDS:
        return "OBJ"
    if word == b"solid" and b"facet" in head:
        return "STL"
    if word.startswith((b"{", b"[")):
        return "JSON"
    if b"\0" in content:
        raise ValueError(f"the content is of no format that is read: {', '.join(FORMATS)}")
    return "XYZ, CSV, TSV"


def _first_word(head: bytes) -> bytes:
    """Returns the first word of a text that is no comment."""
    for line in head.removeprefix(b"\xef\xbb\xbf").split(b"\n"):
        words = line.split(maxsplit=1)
        if words and not words[0].startswith(b"#"):
            return words[0]
    return b""
