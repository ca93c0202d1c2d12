"""Compares normals of the service at the vertices of meshes with the normals of the faces.

The meshes are four resolutions of the dragon, and the cortex. The cortex is the surfaces of white and grey
matter of a mean brain (fsaverage5). Its folds are about as thin as the distance between its vertices.
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
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from .clouds import Floats
from .scale.data import Dragon, of_mesh

FOLDER = Path(__file__).resolve().parents[1] / ".build" / "scale"
CORTEX = "nilearn==0.14.1"
SURFACES = ["white_left", "white_right", "pial_left", "pial_right"]

OFF = np.cos(np.radians(30))

#: Smallest length of the area-weighted mean normal of the faces at a vertex for which the faces agree. The
#: length is 1 where all normals are equal.
AGREE = 0.9


def main() -> None:
    print("| mesh | points | flagged | for its side | off | flipped | flipped, flagged ones too |\n" + "|---" * 7 + "|")
    dragon = Dragon(FOLDER)
    for level in (1, 2, 3, 4):
        print(row(f"dragon {level}", *dragon.mesh(level)), flush=True)
    for surface in SURFACES:
        print(row(surface.replace("_", " "), *cortex(surface)), flush=True)


def row(name: str, vertices: Floats, faces: NDArray[np.int64]) -> str:
    """Measures one mesh and returns its row of the table.

    Only points whose faces agree count. `off` and `flipped` are shares of the normals without a flag.
    """
    points, sums, areas = of_mesh(vertices, faces)
    lengths = np.linalg.norm(sums, axis=1)
    is_known = (lengths >= AGREE * areas) & (areas > 0)
    expected = sums / np.where(lengths > 0, lengths, 1)[:, None]
    answer = ask({"cloud": {"points": points.tolist()}, "solver": "local"})
    normals = np.array([normal or [0.0] * 3 for normal in answer["normals"]])
    flags = {entry["query"]: entry["reason"] for entry in answer["degenerate"]}
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
