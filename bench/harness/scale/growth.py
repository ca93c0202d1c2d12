"""Growth of time and memory from a thousand to a million points: of local surfaces, and of each solver."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import growth as drawing

from .data import torus
from .landmarks import ALPHA, noisy, queries
from .service import Service

SIZES = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
QUICK_SIZES = (500, 1_000, 2_000)
#: Number of rounds for clouds of at most `SMALL` points, which take less than a second. The fastest counts.
N_ROUNDS = 5
SMALL = 10_000
N_QUERIES = 1_000

#: A number of points that was extrapolated, not measured. `HALO`: the points that a tile of a million reads,
#: the halo included, relative to its own.
N_PAPER = 1e8
HALO = 1.04

Row = dict[str, float]


@dataclass(frozen=True)
class Request:
    """A request whose cost is measured against the number of points."""

    key: str
    name: str
    path: str
    fields: Mapping[str, Any]
    colour: str
    #: Power of n that its time is expected to grow with.
    power: float = 1
    #: Number of points up to which it is measured.
    most: int = 1_000_000
    has_values: bool = False

    def line(self) -> tuple[str, str, float, str]:
        return self.key, self.name, self.power, self.colour

    def memory_line(self) -> tuple[str, str, float, str]:
        return f"{self.key}_bytes", f"{self.key}, peak above idle", 2 if self.key == "dense" else 1, self.colour


LOCAL = (
    Request("normals", "/v1/normals, local", "/v1/normals", {"solver": "local"}, "#222222"),
    Request("curvatures", "/v1/curvatures, local", "/v1/curvatures", {"solver": "local"}, "#1b6ca8"),
    Request(
        "std",
        "/v1/curvatures, local, with deviations",
        "/v1/curvatures",
        {"solver": "local", "include": ["std"]},
        "#c2571a",
    ),
)
MATERN = {"kernel": {"family": "matern", "nu": 1.5, "length_scale": 0.5}, "alpha": ALPHA}
GAUSS = {"kernel": {"family": "gauss", "length_scale": 1.0}, "alpha": ALPHA}


def of_values(solver: str, fields: Mapping[str, Any], colour: str, power: float = 1, most: int = 1_000_000) -> Request:
    """Values at queries by a solver."""
    family = fields["kernel"]["family"]
    name = f"/v1/interpolation, {solver}, {family}"
    return Request(solver, name, "/v1/interpolation", {**fields, "solver": solver}, colour, power, most, has_values=True)


SOLVERS = (
    of_values("dense", MATERN, "#222222", 3, 10_000),
    of_values("iterative", {**MATERN, "tolerance": 1e-6}, "#c2571a", 1.5, 300_000),
    of_values("landmark", GAUSS, "#1b6ca8"),
    of_values("local", MATERN, "#3a8f4d"),
)


def measure(service: Service, requests: Sequence[Request], sizes: Sequence[int]) -> list[Row]:
    """Measures each size and request in a separate process; returns milliseconds and bytes.

    Time is from the first byte of the cloud sent to the last byte of the answer received.
    """
    rows = []
    for n in sizes:
        points = torus(n).points
        tensors = {"values": noisy(points), "queries": queries(N_QUERIES)}
        row: Row = {"n": n}
        for request in requests:
            if n > request.most:
                continue
            own = tensors if request.has_values else None
            work = service.ask(request.path, points, request.fields, own, N_ROUNDS if n <= SMALL else 1)
            row[request.key] = 1e3 * work.seconds
            row[f"{request.key}_bytes"] = work.peak_bytes - work.idle_bytes
        rows.append(row)
        print("   " + ", ".join(f"{key} {value:.4g}" for key, value in row.items()), flush=True)
    return rows


def draw(rows: list[Row], requests: Sequence[Request], file: Path) -> None:
    times, memory = [request.line() for request in requests], [request.memory_line() for request in requests]
    slopes = {key: drawing.slope(rows, key) for key, *_ in times + memory}
    file.write_text(drawing.picture(rows, slopes, times, memory))


def table(rows: list[Row], requests: Sequence[Request]) -> str:
    """Formats figures against n, their slopes, and the cost per point at the largest n."""
    lines = ["| n | " + " | ".join(f"{row['n']:,.0f}" for row in rows) + " | slope | a point |"]
    lines.append("|---|" + "---:|" * (len(rows) + 2))
    times, memory = [request.line() for request in requests], [request.memory_line() for request in requests]
    for unit, scale, per_point, series in (("s", 1e-3, "µs", times), ("MB", 1e-6, "bytes", memory)):
        for key, name, _, _ in series:
            cells = " | ".join(drawing.number(scale * row[key]) if key in row else "–" for row in rows)
            last = [row for row in rows if key in row][-1]
            cost = (1e3 if per_point == "µs" else 1) * last[key] / last["n"]
            slope = drawing.slope(rows, key)
            lines.append(f"| {name}, {unit} | {cells} | {slope:.2f} | {drawing.number(cost)} {per_point} |")
    return "\n".join(lines)


def on_paper(row: Row) -> str:
    """Extrapolates the cost of 10⁸ points from the cost per point at the largest n."""
    tiles = N_PAPER / row["n"]
    lines = [
        f"| 10⁸ points in {tiles:,.0f} tiles of {row['n']:,.0f} | time on 2 cores | with 4 % of halo | peak, one tile at a time |"
    ]
    lines.append("|---|---:|---:|---:|")
    for key, name, _, _ in (request.line() for request in LOCAL):
        hours = tiles * row[key] / 3.6e6
        peak = row[f"{key}_bytes"] / 1e9
        lines.append(f"| {name} | {hours:.2f} h | {HALO * hours:.2f} h | {HALO * peak:.2f} GB |")
    return "\n".join(lines)
