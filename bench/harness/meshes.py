"""Compares normals of the service at the vertices of meshes with the normals of the faces.

The meshes are four resolutions of the dragon, and the cortex. The cortex is the surfaces of white and grey
matter of a mean brain (fsaverage5). Its folds are about as thin as the distance between its vertices.

The second table has six of them with noise, beside the best plane fit.
"""

import base64
import gzip
import json
import os
import subprocess
import sys
import urllib.request
import zipfile
import zlib
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .clouds import Floats
from .scale.data import Dragon, of_mesh

FOLDER = Path(__file__).resolve().parents[1] / ".build" / "scale"
CORTEX = "nilearn==0.14.1"
SURFACES = ["white_left", "white_right", "pial_left", "pial_right"]

OFF = np.cos(np.radians(30))

#: Smallest length of the area-weighted mean normal of the faces at a vertex for which the faces agree. The
#: length is 1 where all normals are equal.
AGREE = 0.9

#: Noise of scans in median distances of nearest points, and numbers of neighbours of plane fits.
NOISES = [0.0, 0.1, 0.3, 0.5]
NEIGHBOURS = [8, 16, 32, 64, 128]

#: Deviations within which 95 % of normally distributed errors lie.
BAND = 1.96


def main() -> None:
    print("| mesh | points | flagged | for its side | off | flipped | flipped, flagged ones too |\n" + "|---" * 7 + "|")
    dragon = Dragon(FOLDER)
    for level in (1, 2, 3, 4):
        print(row(f"dragon {level}", *dragon.mesh(level)), flush=True)
    for surface in SURFACES:
        print(row(surface.replace("_", " "), *cortex(surface)), flush=True)
    print("\n| scan | noise, spacings | normals, median | best plane fit | covered |\n" + "|---" * 5 + "|")
    scans = [(f"dragon {level}", dragon.mesh(level)) for level in (2, 3, 4)]
    scans += [(surface.replace("_", " "), cortex(surface)) for surface in (SURFACES[0], SURFACES[2], SURFACES[3])]
    for name, mesh in scans:
        known = Known.of(*mesh)
        for noise in NOISES:
            print(noisy_row(name, known, noise), flush=True)


class Known(NamedTuple):
    """Points of a mesh with the normals of its faces, where these agree."""

    points: Floats
    normals: Floats
    is_known: NDArray[np.bool_]

    @classmethod
    def of(cls, vertices: Floats, faces: NDArray[np.int64]) -> "Known":
        points, sums, areas = of_mesh(vertices, faces)
        lengths = np.linalg.norm(sums, axis=1)
        normals = sums / np.where(lengths > 0, lengths, 1)[:, None]
        return cls(points, normals, (lengths >= AGREE * areas) & (areas > 0))


def row(name: str, vertices: Floats, faces: NDArray[np.int64]) -> str:
    """Measures one mesh and returns its row of the table.

    Only points whose faces agree count. `off` and `flipped` are shares of the normals without a flag.
    """
    points, expected, is_known = Known.of(vertices, faces)
    answer = ask({"cloud": {"points": points.tolist()}, "solver": "local"})
    normals = np.array([normal or [0.0] * 3 for normal in answer["normals"]])
    flags = {entry["query"]: entry["reason"] for entry in answer["flags"]}
    is_flagged = np.isin(np.arange(len(points)), list(flags)) & is_known
    is_ambiguous = np.array([flags.get(point) == "ambiguous_side" for point in range(len(points))])
    cosines = np.einsum("ij,ij->i", normals, expected)
    served = cosines[is_known & ~is_flagged]
    shares = [
        is_flagged.sum() / is_known.sum(),
        is_ambiguous[is_known].mean(),
        (np.abs(served) < OFF).mean(),
        (served <= -OFF).mean(),
        (cosines[is_known] < 0).mean(),
    ]
    return f"| {name} | {len(points):,} | " + " | ".join(f"{share:.2%}" for share in shares) + " |"


def noisy_row(name: str, known: Known, noise: float) -> str:
    """Adds noise to a scan, and compares the service with the plane fit of the best of several sizes."""
    tree = cKDTree(known.points)
    spacing = np.median(tree.query(known.points, 2)[0][:, 1])
    moved = known.points + noise * spacing * np.random.default_rng(3).normal(size=known.points.shape)
    answer = ask({"cloud": {"points": moved.tolist()}, "solver": "local", "include": ["std"]})
    found = np.array([normal or [0.0] * 3 for normal in answer["normals"]])
    bars = np.array([bar or 0.0 for bar in answer["normal_std"]])
    off = angles(found, known)
    best = min(np.median(angles(planes(moved, count), known)) for count in NEIGHBOURS)
    covered = (off <= BAND * bars[known.is_known]).mean()
    median, best = np.degrees([np.median(off), best])
    return f"| {name} | {noise} | {median:.2f}° | {best:.2f}° | {covered:.0%} |"


def angles(normals: Floats, known: Known) -> Floats:
    cosines = np.abs(np.einsum("ij,ij->i", normals, known.normals))[known.is_known]
    return np.arccos(np.clip(cosines, 0, 1))


def planes(points: Floats, count: int) -> Floats:
    """Returns the normals of least squares planes through the nearest points."""
    near = points[cKDTree(points).query(points, count)[1]]
    arms = near - near.mean(axis=1, keepdims=True)
    return np.linalg.eigh(np.einsum("nka,nkb->nab", arms, arms))[1][:, :, 0]


def ask(body: dict[str, object]) -> dict[str, list]:
    request = urllib.request.Request(
        os.environ["GRAMIAN_URL"] + "/v1/normals", json.dumps(body).encode(), {"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request, timeout=600) as response:
        answer: dict[str, list] = json.load(response)
    return answer


def cortex(surface: str) -> tuple[Floats, NDArray[np.int64]]:
    """Returns vertices and triangles of a surface in the nilearn package of PyPI."""
    if not (wheels := list(FOLDER.glob("nilearn-*.whl"))):
        download = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(FOLDER), CORTEX]
        subprocess.run(download, check=True)
        wheels = list(FOLDER.glob("nilearn-*.whl"))
    with zipfile.ZipFile(wheels[0]) as wheel:
        text = gzip.decompress(wheel.read(f"nilearn/datasets/data/fsaverage5/{surface}.gii.gz"))
    vertices, faces = map(array, ElementTree.fromstring(text).iter("DataArray"))
    return vertices.astype(np.float64), faces.astype(np.int64)


def array(element: ElementTree.Element) -> NDArray:
    """Decodes an array of a GIFTI file."""
    assert element.get("Encoding") == "GZipBase64Binary" and element.get("Endian") == "LittleEndian"
    kind = {"NIFTI_TYPE_FLOAT32": "<f4", "NIFTI_TYPE_INT32": "<i4"}[element.attrib["DataType"]]
    data = zlib.decompress(base64.b64decode(element.findtext("Data", "")))
    return np.frombuffer(data, kind).reshape(int(element.attrib["Dim0"]), int(element.attrib["Dim1"]))


if __name__ == "__main__":
    main()
