"""OBJ and STL: the vertices of meshes."""

from __future__ import annotations

import numpy as np

from .columns import NORMALS, POSITIONS, Columns, FileCloud
from .records import ends_early, lines_of, number_of, text_columns

WEIGHT = "weight"

VERTEX = {
    3: POSITIONS,
    4: [*POSITIONS, WEIGHT],
    6: [*POSITIONS, "red", "green", "blue"],
    7: [*POSITIONS, WEIGHT, "red", "green", "blue"],
}
"""Columns of vertices of OBJ, by the numbers in their lines."""

N_TITLE_BYTES = 80

FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
"""A facet of a binary STL file."""


def read_obj(content: bytes) -> FileCloud:
    """Reads vertices, and normals if each vertex has one: as many in the same order, or named by the faces.

    Raises
    ------
    ValueError
        If a vertex or a normal cannot be read, or there are no vertices.
    """
    mesh = _Mesh()
    for number, (keyword, *words) in lines_of(content):
        if keyword == "v":
            mesh.add_vertex(words, number)
        elif keyword == "vn":
            mesh.add_normal(words, number)
        elif keyword == "f":
            mesh.add_face(words)
    return mesh.columns().cloud()


class _Mesh:
    def __init__(self) -> None:
        self.vertices: list[list[float]] = []
        self.lines: list[int] = []
        self.normals: list[list[float]] = []
        self.normal_of: dict[int, int] = {}
        self.has_faces = False
        self.is_torn = False
        """Whether faces give a vertex several normals, or none."""

    def add_vertex(self, words: list[str], line: int) -> None:
        n = len(words)
        if n not in VERTEX:
            expected = "a vertex has 3 coordinates, and maybe a weight and 3 colours"
            raise ValueError(f"line {line}: {expected}, not {n} numbers")
        if self.vertices and len(self.vertices[0]) != n:
            raise ValueError(f"line {line}: {n} numbers, where the vertices before have {len(self.vertices[0])}")
        self.vertices.append([number_of(word, line) for word in words])
        self.lines.append(line)

    def add_normal(self, words: list[str], line: int) -> None:
        if len(words) != 3:
            raise ValueError(f"line {line}: a normal has 3 numbers, not {len(words)}")
        self.normals.append([number_of(word, line) for word in words])

    def add_face(self, corners: list[str]) -> None:
        self.has_faces = True
        for corner in corners:
            vertex, _, rest = corner.partition("/")
            v = _index(vertex, len(self.vertices))
            n = _index(rest.split("/")[1] if "/" in rest else "", len(self.normals))
            if v is None or n is None:
                self.is_torn = True
                continue
            known = self.normal_of.setdefault(v, n)
            self.is_torn |= self.normals[known] != self.normals[n]

    def columns(self) -> Columns:
        n = len(self.vertices)
        names = VERTEX[len(self.vertices[0])] if self.vertices else POSITIONS
        columns = text_columns(names, self.vertices, self.lines)
        numbers = {name: column for name, column in columns.numbers.items() if name != WEIGHT}
        if not self.has_faces:
            self.normal_of = {index: index for index in range(len(self.normals))}
        if n > 0 and not self.is_torn and self.normal_of.keys() == set(range(n)):
            normals = np.array([self.normals[self.normal_of[index]] for index in range(n)])
            numbers |= {name: normals[:, axis] for axis, name in enumerate(NORMALS[0])}
        return Columns(numbers, self.lines)


def _index(word: str, n: int) -> int | None:
    """Returns the index that a word names: from 1 on, or back from the last of `n`."""
    if not (word.isascii() and word.removeprefix("-").isdigit()):
        return None
    index = int(word) + n if word.startswith("-") else int(word) - 1
    return index if 0 <= index < n else None


def read_stl(content: bytes) -> FileCloud:
    """Reads the corners of triangles, each once. Normals of facets are none of corners, and are skipped.

    Raises
    ------
    ValueError
        If the file is damaged, or has no triangles.
    """
    # Some binary files begin with "solid" as well, but name no facet in their title.
    head = content[:1024]
    is_text = head.lstrip().startswith(b"solid") and (b"facet" in head or b"endsolid" in head)
    return (_text_facets(content) if is_text else _binary_facets(content)).cloud()


def _text_facets(content: bytes) -> Columns:
    corners: dict[tuple[float, ...], int] = {}
    has_end = False
    for number, (keyword, *words) in lines_of(content):
        has_end |= keyword == "endsolid"
        if keyword != "vertex":
            continue
        corner = tuple(number_of(word, number) for word in words)
        if len(corner) != 3:
            raise ValueError(f"line {number}: a vertex has 3 numbers, not {len(corner)}")
        corners.setdefault(corner, number)
    if not has_end:
        raise ValueError("the file ends before its line endsolid")
    return text_columns(POSITIONS, list(corners), list(corners.values()))


def _binary_facets(content: bytes) -> Columns:
    body = N_TITLE_BYTES + 4
    if len(content) < body:
        raise ValueError("the file ends before its number of facets")
    count = int.from_bytes(content[N_TITLE_BYTES:body], "little")
    n_there = (len(content) - body) // FACET.itemsize
    if n_there < count:
        raise ends_early("facet", n_there, count)
    facets = np.frombuffer(content, FACET, count, body)["corners"]
    broken = np.flatnonzero(~np.isfinite(facets).all(axis=(1, 2)))
    if len(broken) > 0:
        raise ValueError(f"facet {broken[0] + 1} of {count}: a coordinate is not finite")
    corners = facets.reshape(-1, 3).astype(np.float64)
    _, first = np.unique(corners, axis=0, return_index=True)
    distinct = corners[np.sort(first)]
    return Columns({name: distinct[:, axis] for axis, name in enumerate(POSITIONS)}, record="corner")
