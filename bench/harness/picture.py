"""Draws docs/scan.png: a scan coloured by its mean curvature, and by the standard deviation of that."""

import argparse
import io
import os
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from numpy.typing import NDArray
from PIL import Image

from .clouds import Floats
from .scale.data import Dragon
from .scale.service import Service, use_cores
from .setting import N_THREADS, Setting

ROOT = Path(__file__).resolve().parents[2]
BINARY = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "gramian"
PICTURE = ROOT / "docs" / "scan.png"
MAX_BYTES = 400_000

#: Millimetres per metre: the scan is in metres, its curvatures are shown in 1/mm.
MILLIMETRES = 1e3

#: Camera angles in degrees: first around the upright axis of the scan, then up. Light comes from above the
#: camera, to its left.
AROUND, UP = -25.0, 12.0
LIGHT = np.array([-0.45, 0.55, 0.7])
AMBIENT = 0.55

#: Size in inches and pixels per inch. A page 800 pixels wide shows the picture at half its resolution.
WIDTH, HEIGHT, RESOLUTION = 10.0, 4.3, 160
MARKER = 4.6
BENT = 0.5
DEVIATIONS = (0.005, 0.5)


def main() -> None:
    parser = argparse.ArgumentParser(prog="bench/picture", description=__doc__)
    parser.add_argument("--binary", type=Path, default=BINARY, help="a server already built")
    parser.add_argument("--level", type=int, choices=[1, 2], default=2, help="1 is the full scan, 2 the first decimation")
    parser.add_argument("--rounds", type=int, default=3, help="the fastest of so many is printed")
    arguments = parser.parse_args()
    if not arguments.binary.exists():
        sys.exit(f"there is no {arguments.binary}")
    use_cores(N_THREADS)
    setting = Setting(ROOT, is_quick=False, with_gpytorch=False)
    points = Dragon(setting.build / "scale").scan(arguments.level).points
    asked = {"include": ["std"]}
    answer = Service(setting, arguments.binary, {}).ask("/v1/curvatures", points, asked, n_rounds=arguments.rounds)
    curvatures, deviations = (answer.member(name) / MILLIMETRES for name in ("mean_curvatures", "mean_curvature_std"))
    PICTURE.write_bytes(picture(points, answer.member("normals"), curvatures, deviations))
    low, middle, high = np.nanquantile(deviations, [0.05, 0.5, 0.95])
    print(f"{len(points):,} points in {answer.seconds:.1f} s; {np.isnan(curvatures).sum()} without curvatures")
    print(f"deviations in 1/mm: median {middle:.3f}, nine tenths from {low:.3f} to {high:.3f}")
    print(f"{PICTURE.relative_to(ROOT)}: {PICTURE.stat().st_size / 1e3:.0f} kB")
    if PICTURE.stat().st_size > MAX_BYTES:
        sys.exit(f"more than {MAX_BYTES / 1e3:.0f} kB")


def picture(points: Floats, normals: Floats, curvatures: Floats, deviations: Floats) -> bytes:
    """Draws the two panels, seen from the same side with the same light; returns a PNG."""
    turned, facing = points @ camera().T, normals @ camera().T
    # Points turned away from the camera are left out. The nearest points are drawn last, over the others.
    seen = np.flatnonzero((facing[:, 2] > 0) & np.isfinite(curvatures))
    seen = seen[np.argsort(turned[seen, 2])]
    shade = AMBIENT + (1 - AMBIENT) * np.clip(facing[seen] @ LIGHT / np.linalg.norm(LIGHT), 0, 1)
    places = turned[seen, :2] * MILLIMETRES
    figure, (left, right) = plt.subplots(1, 2, figsize=(WIDTH, HEIGHT), dpi=RESOLUTION, layout="constrained")
    panel(left, places, shade, curvatures[seen], "RdBu_r", Normalize(-BENT, BENT), "mean curvature, 1/mm")
    panel(right, places, shade, deviations[seen], "viridis", LogNorm(*DEVIATIONS), "its standard deviation, 1/mm")
    written = io.BytesIO()
    figure.savefig(written, format="png")
    plt.close(figure)
    # With a palette the file is a third as large.
    image = Image.open(written).convert("RGB").quantize(256, kmeans=20, dither=Image.Dither.NONE)
    packed = io.BytesIO()
    image.save(packed, format="png", optimize=True)
    return packed.getvalue()


def panel(
    axes: Axes, places: NDArray[np.float64], shade: Floats, values: Floats, colours: str, scale: Normalize, label: str
) -> None:
    """Draws points as discs coloured by their values, with a colour bar.

    Discs are darker where the surface is turned away from the light.
    """
    mapped = plt.cm.ScalarMappable(scale, colours)
    rgb = mapped.to_rgba(values)[:, :3] * shade[:, None]
    axes.scatter(*places.T, s=MARKER, c=rgb, linewidths=0)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.margins(0.01)
    bar = axes.figure.colorbar(mapped, ax=axes, location="bottom", shrink=0.75, aspect=32, pad=0.02, extend="both")
    bar.set_label(label, size=14)
    bar.ax.tick_params(labelsize=13)


def camera() -> Floats:
    """Returns the axes of the picture as rows: right, up, towards the eye."""
    a, b = np.radians([AROUND, UP])
    around = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    up = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return up @ around


if __name__ == "__main__":
    main()
