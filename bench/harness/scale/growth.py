"""Growth of time and memory of local normals and curvatures, drawn in docs/scale.svg.

Sizes go from a thousand to a million points.
"""

from collections.abc import Sequence
from pathlib import Path

import growth as drawing

from .data import torus
from .service import Service

SIZES = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
QUICK_SIZES = (500, 1_000, 2_000)
#: Number of rounds for clouds of at most `SMALL` points, which take less than a second. The fastest counts.
N_ROUNDS = 5
SMALL = 30_000

#: A number of points that was extrapolated, not measured. `HALO`: the points that a tile of a million reads,
#: the halo included, relative to its own.
N_PAPER = 1e8
HALO = 1.04

Row = dict[str, float]

TIMES = [
    ("normals", "/v1/normals, local", 1, "#222222"),
    ("curvatures", "/v1/curvatures, local", 1, "#1b6ca8"),
    ("deviations", "/v1/curvatures, local, with deviations", 1, "#c2571a"),
]
MEMORY = [(f"{key}_bytes", f"{key}, peak above idle", slope, colour) for key, _, slope, colour in TIMES]
REQUESTS = {
    "normals": ("/v1/normals", {}),
    "curvatures": ("/v1/curvatures", {}),
    "deviations": ("/v1/curvatures", {"include": ["deviations"]}),
}


def measure(service: Service, sizes: Sequence[int]) -> list[Row]:
    """Measures each size and request in a separate process; returns milliseconds and bytes.

    Time is from the first byte of the cloud sent to the last byte of the answer received.
    """
    rows = []
    for n in sizes:
        points = torus(n).points
        row: Row = {"n": n}
        for name, (path, request) in REQUESTS.items():
            work = service.ask(path, points, {"solver": "local", **request}, n_rounds=N_ROUNDS if n <= SMALL else 1)
            row[name] = 1e3 * work.seconds
            row[f"{name}_bytes"] = work.peak_bytes - work.idle_bytes
        rows.append(row)
        print("   " + ", ".join(f"{key} {value:.4g}" for key, value in row.items()), flush=True)
    return rows


def draw(rows: list[Row], file: Path) -> None:
    file.write_text(drawing.picture(rows, slopes(rows), TIMES, MEMORY))


def slopes(rows: list[Row]) -> dict[str, float]:
    return {key: drawing.slope(rows, key) for key, *_ in TIMES + MEMORY}


def table(rows: list[Row]) -> str:
    """Formats figures against n, their slopes, and the cost per point at the largest n."""
    steep = slopes(rows)
    lines = ["| n | " + " | ".join(f"{row['n']:,.0f}" for row in rows) + " | slope | a point |"]
    lines.append("|---|" + "---:|" * (len(rows) + 2))
    last = rows[-1]
    for unit, scale, per_point, series in (("s", 1e-3, "µs", TIMES), ("MB", 1e-6, "bytes", MEMORY)):
        for key, name, _, _ in series:
            cells = " | ".join(drawing.number(scale * row[key]) for row in rows)
            cost = (1e3 if per_point == "µs" else 1) * last[key] / last["n"]
            lines.append(f"| {name}, {unit} | {cells} | {steep[key]:.2f} | {drawing.number(cost)} {per_point} |")
    return "\n".join(lines)


def on_paper(row: Row) -> str:
    """Extrapolates the cost of 10⁸ points from the cost per point at the largest n."""
    tiles = N_PAPER / row["n"]
    lines = [
        f"| 10⁸ points in {tiles:,.0f} tiles of {row['n']:,.0f} | time on 2 cores | with 4 % of halo | peak, one tile at a time |"
    ]
    lines.append("|---|---:|---:|---:|")
    for key, name, _, _ in TIMES:
        hours = tiles * row[key] / 3.6e6
        peak = row[f"{key}_bytes"] / 1e9
        lines.append(f"| {name} | {hours:.2f} h | {HALO * hours:.2f} h | {HALO * peak:.2f} GB |")
    return "\n".join(lines)
