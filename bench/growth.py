#!/usr/bin/env python3
"""Measures how time and memory grow with the number of points, and draws docs/growth.svg.

    bench/growth.py [--binary GRAMIAN] [--sizes N,N,…] [--rounds K] [--svg FILE] [--table FILE]

Each size and round starts two new servers: one answers /v1/curvatures, the other /v1/normals. The peak
resident memory of each is therefore that of one cold request. The server of /v1/normals then answers from its
cache: new values (one solve), values seen before at one query, and posterior variances at 100 queries.

Times are the best of the rounds. Stages come from Server-Timing. Slopes are fitted to log time against log n
over the larger half of the sizes. Needs only the standard library.
"""

import argparse
import http.client
import json
import math
import os
import subprocess
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
SIZES = [500, 750, 1100, 1650, 2450, 3650, 5400, 8000, 12000]
KERNEL = {"family": "matern", "length_scale": 0.3}
N_WARM = 50
SECONDS = 600

# Key, name, expected slope, colour. Times are in milliseconds.
TIMES = [
    ("normals", "/v1/normals, cold, whole request", 3, "#222222"),
    ("curvatures", "/v1/curvatures, cold, whole request", 3, "#888888"),
    ("factor", "factorization", 3, "#c2571a"),
    ("gram", "Gram matrix", 2, "#1b6ca8"),
    ("solve", "weights of new values", 2, "#3a8f4d"),
    ("variance", "variances at 100 queries, whole request", 2, "#7b4ea3"),
    ("warm", "one query, values seen before, whole request", 1, "#b8860b"),
]
MEMORY = [
    ("normals_bytes", "peak of /v1/normals above idle", 2, "#222222"),
    ("curvatures_bytes", "peak of /v1/curvatures above idle", 2, "#888888"),
    ("matrix_bytes", "8 n², the matrix", 2, "#c2571a"),
]


def main():
    parser = argparse.ArgumentParser(description="Measures how time and memory grow with the number of points.")
    parser.add_argument("--binary", type=Path, default=TARGET / "release/gramian")
    parser.add_argument("--sizes", type=lambda text: [int(n) for n in text.split(",")], default=SIZES)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--svg", type=Path, default=ROOT / "docs/growth.svg")
    parser.add_argument("--table", type=Path, default=ROOT / "bench/growth.md")
    arguments = parser.parse_args()
    rows = []
    for n in arguments.sizes:
        rounds = [measure(arguments.binary, n) for _ in range(arguments.rounds)]
        # Times depend on chance, so the best round counts. Memory does not, so the largest one counts.
        best = {key: (max if key.endswith("_bytes") else min)(found[key] for found in rounds) for key in rounds[0]}
        rows.append({"n": n, **best})
        print(", ".join(f"{key} {value:.4g}" for key, value in rows[-1].items()), flush=True)
    slopes = {key: slope(rows, key) for key, *_ in TIMES + MEMORY}
    arguments.table.write_text(table(rows, slopes))
    arguments.svg.write_text(picture(rows, slopes, TIMES, MEMORY))
    print(arguments.table.read_text())


def measure(binary, n):
    """Measures one size once; returns milliseconds and bytes by key."""
    points = sphere(n)
    cloud = {"cloud": {"points": points}, "kernel": KERNEL, "alpha": 1e-8}
    found = {"matrix_bytes": 8 * n * n}
    with server(binary) as (process, address):
        idle = memory(process, "VmRSS")
        _, found["curvatures"], _ = ask(address, "/v1/curvatures", cloud)
        found["curvatures_bytes"] = memory(process, "VmHWM") - idle
    with server(binary) as (process, address):
        idle = memory(process, "VmRSS")
        answer, found["normals"], stages = ask(address, "/v1/normals", cloud)
        found["normals_bytes"] = memory(process, "VmHWM") - idle
        found["gram"], found["factor"] = stages["gram"], stages["factor"]
        known = {**cloud, "cloud": {"id": answer["diagnostics"]["cloud_id"]}}
        values = [x * y + z for x, y, z in points]
        seen = {**known, "values": values, "queries": points[:1]}
        found["solve"] = ask(address, "/v1/interpolation", seen)[2]["solve"]
        found["warm"] = min(ask(address, "/v1/interpolation", seen)[1] for _ in range(N_WARM))
        variance = {**known, "values": values, "queries": points[:100], "include": ["variances"]}
        found["variances"] = ask(address, "/v1/posterior", variance)[1]
    return found


@contextmanager
def server(binary):
    """Starts a new server on a free port; yields its process and address."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GRAMIAN_")}
    command = [binary, "--bind", "127.0.0.1:0", "--deadline-seconds", str(SECONDS)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        yield process, json.loads(process.stderr.readline())["fields"]["address"]
    finally:
        process.kill()
        process.communicate()


def ask(address, path, request):
    """Posts a request; returns the answer, its milliseconds and those of each stage.

    Milliseconds count from the first byte sent to the last byte received.
    """
    body = json.dumps(request).encode()
    connection = http.client.HTTPConnection(address, timeout=SECONDS)
    connection.connect()
    began = perf_counter()
    connection.request("POST", path, body, {"Content-Type": "application/json"})
    response = connection.getresponse()
    answer = response.read()
    milliseconds = 1e3 * (perf_counter() - began)
    connection.close()
    if response.status != 200:
        raise SystemExit(f"{path}: {response.status} {answer[:500]!r}")
    entries = (entry.strip().split(";dur=") for entry in response.getheader("Server-Timing").split(","))
    return json.loads(answer), milliseconds, {name: float(duration) for name, duration in entries}


def memory(process, field):
    """Returns VmRSS or VmHWM of a process, in bytes."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return 1024 * next(int(line.split()[1]) for line in status.splitlines() if line.startswith(field + ":"))


def sphere(n):
    """Returns n points on the unit sphere: z_i = 1 − (2i+1)/n, angle π(1+√5)i."""
    golden = math.pi * (1 + math.sqrt(5))
    heights = [1 - (2 * i + 1) / n for i in range(n)]
    radii = [math.sqrt(1 - z * z) for z in heights]
    return [[r * math.cos(golden * i), r * math.sin(golden * i), z] for i, (r, z) in enumerate(zip(radii, heights))]


def slope(rows, key):
    """Fits log value against log n by least squares over the larger half of the sizes that were measured; returns the slope."""
    known = [row for row in rows if key in row]
    upper = known[len(known) // 2 :]
    x = [math.log(row["n"]) for row in upper]
    y = [math.log(row[key]) for row in upper]
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    spread = sum((a - mean_x) ** 2 for a in x)
    return sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y)) / spread if spread else math.nan


def table(rows, slopes):
    """Formats the measurements and slopes as a Markdown table."""
    sizes = [row["n"] for row in rows]
    lines = ["| n | " + " | ".join(f"{n:,}" for n in sizes) + " | slope | expected |"]
    lines.append("|---|" + "---:|" * (len(sizes) + 2))
    for unit, scale, series in (("ms", 1, TIMES), ("MB", 1e-6, MEMORY)):
        for key, name, expected, _ in series:
            cells = " | ".join(number(scale * row[key]) for row in rows)
            lines.append(f"| {name}, {unit} | {cells} | {slopes[key]:.2f} | {expected} |")
    for path in ("normals", "curvatures"):
        cells = " | ".join(f"{row[path + '_bytes'] / row['matrix_bytes']:.2f}" for row in rows)
        lines.append(f"| peak of /v1/{path} over 8 n² | {cells} | | 1 |")
        steps = zip(rows, rows[1:])
        added = [(b[path + "_bytes"] - a[path + "_bytes"]) / (b["matrix_bytes"] - a["matrix_bytes"]) for a, b in steps]
        cells = " | ".join(f"{share:.2f}" for share in added)
        lines.append(f"| the same, growth over growth from the size before | | {cells} | | 1 |")
    half = f"{rows[len(rows) // 2]['n']:,}"
    lines.append(
        f"\nSlopes of log against log from n = {half}, best of the rounds. Memory is above that of the idle process; what is"
    )
    lines.append("paid once, whatever n, keeps its slope below 2 and drops out of growth over growth.")
    return "\n".join(lines) + "\n"


def number(x):
    return f"{x:.3g}" if x < 100 else f"{x:,.0f}"


class Panel:
    """A plot with logarithmic axes."""

    WIDTH, HEIGHT, TOP = 400, 330, 50

    def __init__(self, left, title, x_range, y_range):
        self.left, self.title, self.x_range, self.y_range = left, title, x_range, y_range

    def place(self, x, y):
        across = math.log(x / self.x_range[0]) / math.log(self.x_range[1] / self.x_range[0])
        up = math.log(y / self.y_range[0]) / math.log(self.y_range[1] / self.y_range[0])
        return self.left + self.WIDTH * across, self.TOP + self.HEIGHT * (1 - up)

    def frame(self, x_ticks, y_label):
        right, bottom = self.left + self.WIDTH, self.TOP + self.HEIGHT
        yield f'<text x="{self.left}" y="{self.TOP - 14}" font-weight="bold">{self.title}</text>'
        for power in range(math.ceil(math.log10(self.y_range[0])), math.floor(math.log10(self.y_range[1])) + 1):
            y = self.place(self.x_range[0], 10**power)[1]
            yield f'<path d="M{self.left} {y:.1f}H{right}" stroke="#ddd"/>'
            yield f'<text x="{self.left - 6}" y="{y + 4:.1f}" text-anchor="end">{y_label(power)}</text>'
        for tick in x_ticks:
            x = self.place(tick, self.y_range[0])[0]
            yield f'<path d="M{x:.1f} {bottom}v5" stroke="#888"/>'
            yield f'<text x="{x:.1f}" y="{bottom + 18}" text-anchor="middle">{tick:,}</text>'
        yield f'<text x="{(self.left + right) / 2}" y="{bottom + 36}" text-anchor="middle">points, n</text>'
        yield f'<rect x="{self.left}" y="{self.TOP}" width="{self.WIDTH}" height="{self.HEIGHT}" fill="none" stroke="#888"/>'

    def curve(self, index, rows, key, name, colour, slope, expected):
        points = [self.place(row["n"], row[key]) for row in rows if key in row]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        yield f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>'
        yield from (f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{colour}"/>' for x, y in points)
        y = self.TOP + self.HEIGHT + 62 + 18 * index
        yield f'<path d="M{self.left} {y - 4}h18" stroke="{colour}" stroke-width="2"/>'
        yield f'<text x="{self.left + 24}" y="{y}">{name}: slope {slope:.2f}, expected {expected}</text>'


def picture(rows, slopes, times, memory):
    """Draws time on the left and memory on the right; returns the SVG."""
    x_range = (rows[0]["n"] / 1.1, rows[-1]["n"] * 1.1)
    ticks = (500, 1000, 2000, 4000, 8000, 16000) if x_range[1] < 50_000 else (1000, 10_000, 100_000, 1_000_000)
    x_ticks = [tick for tick in ticks if x_range[0] <= tick <= x_range[1]]
    panels = [
        (Panel(70, "time", x_range, bounds(rows, times)), times, duration_label),
        (Panel(560, "memory", x_range, bounds(rows, memory)), memory, size_label),
    ]
    width, height = 990, Panel.TOP + Panel.HEIGHT + 70 + 18 * len(times)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    for panel, series, label in panels:
        parts += panel.frame(x_ticks, label)
        for index, (key, name, expected, colour) in enumerate(series):
            parts += panel.curve(index, rows, key, name, colour, slopes[key], expected)
    return "\n".join(parts + ["</svg>"]) + "\n"


def bounds(rows, series):
    values = [row[key] for row in rows for key, *_ in series if key in row]
    return min(values) / 1.5, max(values) * 1.5


def duration_label(power):
    return f"{10 ** (power - 3):g} s" if power >= 3 else f"{10**power:g} ms" if power >= 0 else f"{10 ** (power + 3):g} µs"


def size_label(power):
    return (
        f"{10 ** (power - 9):g} GB" if power >= 9 else f"{10 ** (power - 6):g} MB" if power >= 6 else f"{10 ** (power - 3):g} kB"
    )


if __name__ == "__main__":
    main()
