"""`POST /v1/posterior` on a cached factor.

Latency and throughput are compared with an echo server, the solve for new values with reading the triangle.
"""

import re
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..clouds import sphere
from ..report import Bound, Figure, Row
from ..server import Answer, Client, Server, encode
from ..setting import Setting
from ..timing import Times, alternate

NEW_VALUES = Bound("ratio", "≤", 5)
KERNEL = {"family": "matern", "nu": 2.5, "length_scale": 0.2}
PATH, ECHO = "/v1/posterior", "/echo"
HEADERS = {"Content-Type": "application/json"}

WRK_SCRIPT = """
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
local file = io.open("{body}", "rb")
wrk.body = file:read("*a")
file:close()
"""


def measure(setting: Setting) -> Iterable[Row]:
    with setting.gramian() as server, setting.echo() as echo:
        yield latency(setting, server, echo)
        yield throughput(setting, server, echo)
        for n in (4000, 8000):
            yield new_values(setting, server, setting.size(n))


def latency(setting: Setting, server: Server, echo: Server) -> Row:
    n = setting.size(2000)
    ours, theirs = server.client(), echo.client()
    body = encode(one_query(ours, n))

    def ask(client: Client, path: str) -> float:
        answer = client.request("POST", path, body, HEADERS)
        assert answer.status == 200, answer.body[:300]
        return answer.seconds

    tasks = {"ours": lambda _: ask(ours, PATH), "echo": lambda _: ask(theirs, ECHO)}
    times = alternate(setting.rounds(600), tasks)
    figures = {name: Figure(spent.median * 1e3, "ms") for name, spent in times.items()}
    remark = f"medians; reference: an axum handler that parses and echoes the same {len(body):,} bytes"
    what = f"one-query mean, n = {n:,}, known values: latency"
    return Row(what, figures["ours"], figures["echo"], Bound("difference", "≤", 0.5), remark)


def throughput(setting: Setting, server: Server, echo: Server) -> Row:
    n = 256
    body = encode(one_query(server.client(), n))
    rates: dict[str, list[float]] = {"ours": [], "echo": []}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "body.json").write_bytes(body)
        script = Path(folder) / "post.lua"
        script.write_text(WRK_SCRIPT.format(body=Path(folder) / "body.json"))
        for _ in range(setting.rounds(3)):
            rates["ours"].append(load(server.port, PATH, script, setting.rounds(5)))
            rates["echo"].append(load(echo.port, ECHO, script, setting.rounds(5)))
    figures = {name: Figure(max(found), "requests/s", float(np.median(found))) for name, found in rates.items()}
    remark = f"wrk on the same 2 cores; reference: the echo of the same {len(body):,} bytes"
    what = f"one-query mean, n = {n}, known values: rate on 16 connections"
    return Row(what, figures["ours"], figures["echo"], Bound("figure", "≥", 5000), remark, more_is_better=True)


def load(port: int, path: str, script: Path, seconds: int) -> float:
    """Returns the requests per second that wrk reaches. Raises if an answer is not a success."""
    command = ["wrk", "-t1", "-c16", f"-d{seconds}s", "-s", str(script), f"http://127.0.0.1:{port}{path}"]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found = re.search(r"Requests/sec:\s+([\d.]+)", output)
    if found is None or "Non-2xx" in output or "Socket errors" in output:
        raise RuntimeError(output)
    return float(found[1])


def new_values(setting: Setting, server: Server, n: int) -> Row:
    """Measures new values, which cost a solve with the factor: its triangle is read twice."""
    client = server.client()
    first = one_query(client, n)
    random = np.random.default_rng(0)
    answers: list[Answer] = []

    def solve(_: int) -> float:
        answers.append(client.post(PATH, {**first, "values": random.normal(size=n)}))
        return answers[-1].stages["solve"]

    with setting.lapack(64, 1.0, 1.0) as lapack:
        tasks = {"ours": solve, **{f"{t}": lambda _, t=t: lapack.ask(f"read {t}")["read"] for t in (1, 2)}}
        times = alternate(setting.rounds(12), tasks)
        bytes_per_second = (512 << 20) / min(times["1"].best, times["2"].best)
    streamed = Times((2 * 8 * n * (n + 1) / 2 / bytes_per_second,))
    client.forget(answers[-1])
    remark = (
        f"`solve` stage, residual included; reference: the triangle read twice at {bytes_per_second / 1e9:.1f} GB/s, "
        f"the rate of OpenBLAS ddot over 512 MiB; the request {min(answer.seconds for answer in answers) * 1e3:.1f} ms"
    )
    return Row(
        f"new values, n = {n:,}: the solve", Figure.of(times["ours"]), Figure(streamed.best * 1e3, "ms"), NEW_VALUES, remark
    )


def one_query(client: Client, n: int) -> dict[str, Any]:
    """Returns a request for one mean, after sending it once so that the factor and the weights are cached."""
    points = sphere(n)
    body = {
        "cloud": {"points": points},
        "kernel": KERNEL,
        "alpha": 1e-6,
        "values": points[:, 2].copy(),
        "queries": [[0.1, 0.2, 0.9]],
    }
    answer = client.post(PATH, body)
    return {**body, "cloud": {"id": answer.json()["diagnostics"]["cloud_id"]}}
