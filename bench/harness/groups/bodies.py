"""Bodies of requests and answers: parsing, writing and sending numbers.

In the process: rates at which JSON numbers are read and written. Over HTTP: a large matrix in each format
beside copying and sending its bytes.
"""

import re
from collections.abc import Iterable

import numpy as np

from ..clouds import sphere
from ..report import Bound, Figure, Row
from ..server import STAGES_OF_COMPUTATION, Answer, Client, Refused, Server
from ..setting import Setting
from ..timing import Times, alternate, timed

PATH = "/v1/laplace-beltrami/matrix"
KERNEL = {"family": "matern", "nu": 2.5, "length_scale": 0.2}

UNIT = "MB/s"

#: Smallest acceptable rates in MB/s, by the first word of the benchmark's name.
BOUNDS = {"read": 350.0, "write": 500.0}

#: First words of a line that the benchmark prints for its reference.
SAME = "the same"

FORMATS = {
    "npy": {"Accept": "application/x-npy"},
    "safetensors": {"Accept": "application/x-safetensors"},
    "JSON": {"Accept": "application/json"},
    "JSON, zstd": {"Accept": "application/json", "Accept-Encoding": "zstd"},
}


def measure(setting: Setting) -> Iterable[Row]:
    yield from in_process(setting)
    yield from over_http(setting)


def in_process(setting: Setting) -> Iterable[Row]:
    """Yields the rates in MB/s that `cargo bench --bench bodies` prints.

    A line `the same by …` is the reference of the line before it.
    """
    if "bodies" not in setting.benches:
        for word, limit in BOUNDS.items():
            yield Row(f"JSON, one core: {word}", None, None, Bound("figure", "≥", limit), "there is no benchmark `bodies`")
        return
    rates = parse(setting.output_of_bench("bodies"))
    for index, (name, rate) in enumerate(rates):
        if name.startswith(SAME):
            continue
        following = rates[index + 1] if index + 1 < len(rates) else ("", 0.0)
        reference = Figure(following[1], UNIT) if following[0].startswith(SAME) else None
        remark = f"reference: {following[0]}" if reference else ""
        limit = next((Bound("figure", "≥", limit) for word, limit in BOUNDS.items() if name.startswith(word)), None)
        yield Row(f"JSON, one core: {name}", Figure(rate, UNIT), reference, limit, remark, more_is_better=True)


def parse(output: str) -> list[tuple[str, float]]:
    """Returns the lines `name  rate` below a heading in MB/s."""
    rates = []
    is_rate = False
    for line in output.splitlines():
        row = re.fullmatch(r"(.*\S)\s{2,}(\d+(?:\.\d+)?)", line)
        if row is None:
            is_rate = UNIT in line
        elif is_rate:
            rates.append((row[1], float(row[2])))
    return rates


def over_http(setting: Setting) -> Iterable[Row]:
    n = setting.size(4000)
    n_bytes = 8 * n * n
    with setting.gramian() as server:
        client = server.client()
        request = {"cloud": {"points": sphere(n)}, "kernel": KERNEL, "alpha": 1e-6}
        # Two rows suffice to make the factor and the surface.
        first = client.post(PATH, {**request, "queries": sphere(2)})
        request["cloud"] = {"id": first.json()["diagnostics"]["cloud_id"]}
        for name, headers in FORMATS.items():
            yield from one_format(setting, server, client, request, name, headers, n_bytes)


def one_format(
    setting: Setting,
    server: Server,
    client: Client,
    request: dict[str, object],
    name: str,
    headers: dict[str, str],
    n_bytes: int,
) -> Iterable[Row]:
    what = f"matrix of {n_bytes / 1e6:.0f} MB as {name}"
    limit = Bound("ratio", "≤", 1.2) if name == "npy" else None
    try:
        server.reset_peak_bytes()
        before = server.memory_bytes("VmRSS")
        probe = client.post(PATH, request, headers)
        peak = server.memory_bytes("VmHWM") - before
    except Refused as refusal:
        yield Row(f"{what}: encode and send", None, None, limit, f"not served: {str(refusal)[:3]}")
        return
    if "zstd" in name and probe.headers.get("content-encoding") != "zstd":
        yield Row(f"{what}: encode and send", None, remark="not served: the answer is not compressed")
        return
    source, target = np.ones(n_bytes // 8), np.ones(n_bytes // 8)
    with setting.bare(n_bytes) as bare:
        plain = bare.client()
        tasks = {
            "ours": lambda _: beyond_computation(client.post(PATH, request, headers)),
            "copy": lambda _: timed(lambda: np.copyto(target, source))[1],
            "write": lambda _: plain.request("GET", "/").seconds,
        }
        times: dict[str, Times] = alternate(setting.rounds(4), tasks)
    reference = Figure.of(times["copy"] + times["write"])
    copied = f"a memory copy ({times['copy'].best * 1e3:.0f} ms) and a bare socket write of {n_bytes / 1e6:.0f} MB"
    remark = (
        f"{len(probe.body) / 1e6:.0f} MB sent; the time beyond {', '.join(STAGES_OF_COMPUTATION)}, until the last byte; "
        f"reference: {copied} to the same client"
    )
    yield Row(f"{what}: encode and send", Figure.of(times["ours"]), reference, limit, remark)
    yield Row(
        f"{what}: memory",
        Figure(peak / n_bytes, "matrices"),
        remark=f"peak of the resident set above what it was before the request, over {n_bytes / 1e6:.0f} MB",
    )


def beyond_computation(answer: Answer) -> float:
    return answer.seconds - sum(answer.stages.get(stage, 0.0) for stage in STAGES_OF_COMPUTATION)
