#!/usr/bin/env python3
"""Loads a server for some minutes like many careless clients, and reports whether it held.

    tests/soak.py GRAMIAN [--minutes 10] [--report FILE]

The server has a directory as its store. The clients:

- post new clouds to every route, as requests and as jobs, and eight equal requests at a time;
- register clouds, ask for estimates, list clouds and scrape metrics;
- read slowly or not at all, send bodies that never end, leave midway, and ask for more than there is memory.

Meanwhile a probe sends small requests, whose clouds are new or known. Before that, on another server, it does
so beside factorizations of 16,400 points. These conditions must hold at the end:

- Every request that was read to its end was answered within its deadline and two seconds. Events are exempt.
- There was no status of 500 and above, except 503 for refusals and 504 for deadlines.
- The resident memory never exceeded the budget by more than a tenth. It was flat within 5 % over the second
  half.
- Beside the factorizations, the 99th percentile of small requests was at most ten times that on the idle
  server. A few time slices of the scheduler are also accepted: when every core computes, a waking thread
  waits its turn.

Needs only the standard library. Figures go to standard output as a table, and to the report as JSON.
"""

import argparse
import contextlib
import http.client
import itertools
import json
import math
import multiprocessing
import os
import random
import signal
import socket
import statistics
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from with_server import server

BUDGET = 1 << 30
DEADLINE = 20.0
# Seconds after the deadline, apart from the network, that the sending of an answer may take.
GRACE = 2.0
FLAGS = [
    *("--threads", "2", "--memory-bytes", str(BUDGET), "--cache-bytes", str(192 << 20)),
    *("--cloud-bytes", str(16 << 20), "--deadline-seconds", str(DEADLINE), "--body-seconds", "3"),
    *("--max-queue", "32", "--job-result-seconds", "60"),
]
# Less than the clouds of half a minute and the factors of some minutes, so that the oldest are evicted
# all the time.
STORE_FLAGS = ["--store-bytes", str(4 << 20), "--store-factor-bytes", str(512 << 20)]
GEOMETRY = ["/v1/normals", "/v1/curvatures", "/v1/laplace-beltrami/matrix", "/v1/surface-gradient/matrix"]
VALUES = ["/v1/interpolation", "/v1/posterior", "/v1/surface-gradient", "/v1/laplace-beltrami"]
# Enough for ten probes above the 99th percentile. With 300 it was the third largest, and varied from 0.5 to
# 4.2 ms between two runs.
N_PROBES_IDLE = 1000
# Up to three threads may run before a probe. Where two threads share a core, a slice of Linux's scheduler
# takes 3 to 4 ms.
SECONDS_OF_SLICES = 0.012
# Each factorization takes more than ten seconds of both cores.
N_LARGE, N_LARGE_POINTS, SECONDS_BESIDE = 4, 16_400, 30


class Soak:
    """A run: the server under load, statuses and failures so far, and the memory of the server over time."""

    def __init__(self, address, pid, minutes):
        self.address = address
        self.host, port = address.removeprefix("http://").rsplit(":", 1)
        self.port, self.pid = int(port), pid
        self.until = time.monotonic() + 60 * minutes
        self.minutes = minutes
        self.lock = threading.Lock()
        self.statuses = Counter()
        self.slowest = 0.0
        self.failures = []
        self.resident = []
        self.serial = 0

    def goes_on(self):
        return time.monotonic() < self.until

    def connection(self):
        return http.client.HTTPConnection(self.host, self.port, timeout=DEADLINE + 30)

    def number(self):
        with self.lock:
            self.serial += 1
            return self.serial

    def note(self, path, status, seconds):
        with self.lock:
            self.statuses[status] += 1
            # Events last as long as their job.
            seconds = 0.0 if path.endswith("/events") else seconds
            self.slowest = max(self.slowest, seconds)
            if seconds > DEADLINE + GRACE:
                self.failures.append(f"{path} took {seconds:.1f} s")
            if status >= 500 and status not in (503, 504):
                self.failures.append(f"{path} answered {status}")

    def call(self, method, path, body=None, connection=None, prefer=None):
        """Sends a request and reads its answer. Returns its status, the seconds it took, and its body."""
        own = connection is None
        connection = connection or self.connection()
        began = time.monotonic()
        try:
            headers = {"Content-Type": "application/json"} if body else {}
            headers |= {"Prefer": prefer} if prefer else {}
            connection.request(method, path, body, headers)
            response = connection.getresponse()
            answer = response.read()
        except (OSError, http.client.HTTPException) as error:
            connection.close()
            with self.lock:
                self.failures.append(f"{path}: {type(error).__name__}: {error}")
            return 0, time.monotonic() - began, b""
        seconds = time.monotonic() - began
        self.note(path, response.status, seconds)
        if own:
            connection.close()
        return response.status, seconds, answer


def cloud(n, k, dimension=3):
    """Returns a sphere that no other request has, or points in a cube of more dimensions.

    All spheres are equally smooth, because their times are compared.
    """
    if dimension != 3:
        source = random.Random(k)
        return [[source.random() for _ in range(dimension)] for _ in range(n)]
    golden = math.pi * (1 + math.sqrt(5))
    points = []
    for i in range(n):
        z = 1 - (2 * i + 1) / n
        r = math.sqrt(1 - z * z)
        points.append([r * math.cos(golden * i), r * math.sin(golden * i), z])
    points[0][0] += 1e-10 * k
    return points


def request_of(source, soak, n):
    """Returns the path and body of a request to any route, with parameters or without."""
    path = source.choice(GEOMETRY + VALUES)
    request = {"cloud": {"points": cloud(n, soak.number())}}
    if path in VALUES:
        request["values"] = [math.sin(i) for i in range(n)]
    if source.random() < 0.5:
        request |= {"kernel": {"family": "matern", "length_scale": 0.4}, "alpha": 1e-6}
    if "matrix" in path:
        request["queries"] = request["cloud"]["points"][:50]
    return path, json.dumps(request)


def post_new_clouds(soak, source):
    connection = soak.connection()
    while soak.goes_on():
        path, body = request_of(source, soak, source.choice([30, 100, 300, 800, 2000]))
        if soak.call("POST", path, body, connection)[0] == 503:
            time.sleep(0.2)


def post_large(soak, source):
    while soak.goes_on():
        _, body = request_of(source, soak, source.choice([3500, 5000, 7000]))
        request = json.loads(body)
        request.pop("values", None)
        request["queries"] = request["cloud"]["points"][:100]
        soak.call("POST", "/v1/normals", json.dumps(request))
        # In many dimensions the search for neighbours is slow, and these points do not form a surface.
        soak.call("POST", "/v1/clouds", json.dumps({"points": cloud(3000, soak.number(), 12)}))


def post_equal(soak, source):
    while soak.goes_on():
        path, body = request_of(source, soak, source.choice([200, 1000]))
        threads = [threading.Thread(target=soak.call, args=("POST", path, body)) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        time.sleep(0.5)


def list_clouds(soak, source):
    while soak.goes_on():
        for path in ("/v1/clouds?limit=1000", "/health/ready", "/metrics"):
            soak.call("GET", path)
        time.sleep(source.uniform(0.05, 0.3))


def register(soak, source):
    """Registers clouds, asks for an estimate, then reads or deletes them.

    The store may have evicted a cloud before it is read.
    """
    while soak.goes_on():
        request = {"points": cloud(source.choice([100, 1000, 5000]), soak.number())}
        status, _, answer = soak.call("POST", "/v1/clouds", json.dumps(request))
        if status == 201:
            known = json.loads(answer)["cloud_id"]
            asked = {"operation": "compute_normals", "cloud": {"id": known}}
            soak.call("POST", "/v1/estimate", json.dumps(asked))
            soak.call(source.choice(["GET", "HEAD", "DELETE"]), f"/v1/clouds/{known}")
        time.sleep(source.uniform(0, 0.3))


def post_jobs(soak, source):
    """Starts jobs. Then waits for the result, follows events, reads the status once, or deletes the job."""
    while soak.goes_on():
        path, body = request_of(source, soak, source.choice([100, 1000, 3000]))
        status, _, answer = soak.call("POST", path, body, prefer="respond-async")
        if status == 202:
            job = f"/v1/jobs/{json.loads(answer)['job_id']}"
            method, path = source.choice([("GET", f"{job}/result"), ("GET", f"{job}/events"), ("GET", job), ("DELETE", job)])
            soak.call(method, path)
        else:
            time.sleep(0.2)


def send(soak, path, body, length=None):
    """Sends a request over a new socket; returns the socket. `length` is the announced size of its body."""
    stream = socket.create_connection((soak.host, soak.port), timeout=DEADLINE + 30)
    head = f"POST {path} HTTP/1.1\r\nHost: soak\r\nContent-Type: application/json\r\n"
    stream.sendall(f"{head}Content-Length: {length or len(body)}\r\n\r\n{body}".encode())
    return stream


def read_slowly(soak, source):
    """Requests a matrix of some 20 MB, and reads a little of it or nothing for up to half a minute."""
    while soak.goes_on():
        with contextlib.suppress(OSError):
            n = 900
            body = json.dumps({"cloud": {"points": cloud(n, soak.number())}, "kernel": {"family": "gauss"}, "alpha": 1e-3})
            with send(soak, "/v1/laplace-beltrami/matrix", body) as stream:
                rest = time.monotonic() + source.uniform(1, 30)
                while time.monotonic() < min(rest, soak.until):
                    if source.random() < 0.5 and not stream.recv(4096):
                        break
                    time.sleep(0.2)


def send_slowly(soak, source):
    """Sends the beginnings of bodies that never end."""
    while soak.goes_on():
        with contextlib.suppress(OSError), contextlib.ExitStack() as stack:
            streams = [
                stack.enter_context(send(soak, "/v1/normals", " " * source.randint(0, 4 << 20), 8 << 20)) for _ in range(6)
            ]
            time.sleep(source.uniform(0.5, 6))
            del streams


def leave(soak, source):
    """Sends requests and closes the connection before the answer."""
    while soak.goes_on():
        with contextlib.suppress(OSError):
            path, body = request_of(source, soak, source.choice([100, 1500, 3000]))
            with send(soak, path, body):
                time.sleep(source.uniform(0, 0.5))


def probe(soak, first, until=math.inf, count=math.inf):
    """Sends small requests, alternating between new clouds, numbered from `first`, and a known one.

    Returns the seconds of each kind, `cold` and `warm`.
    """
    connection, seconds = soak.connection(), {"cold": [], "warm": []}
    known = json.dumps({"cloud": {"points": cloud(100, 0)}})
    for k in itertools.count(first):
        if len(seconds["warm"]) >= count or time.monotonic() >= until:
            break
        new = json.dumps({"cloud": {"points": cloud(100, k)}})
        for kind, body in (("cold", new), ("warm", known)):
            status, taken, _ = soak.call("POST", "/v1/normals", body, connection)
            if status == 200:
                seconds[kind].append(taken)
            else:
                time.sleep(0.1)
        time.sleep(0.02)
    return seconds


def probe_apart(address, pid, until):
    """Probes from a separate process, which the threads of the other clients do not hold up."""
    soak = Soak(address, pid, 0)
    seconds = probe(soak, 10**7, until=until)
    return seconds, soak.statuses, soak.slowest, soak.failures


def probe_beside_large_work(binary):
    """Measures small requests on an idle server, then while four large factorizations wait for each other."""
    flags = ["--threads", "2", "--deadline-seconds", "600"]
    with server(binary, flags) as (base, pid):
        soak = Soak(base, pid, 0)
        idle = probe(soak, 10**6, count=N_PROBES_IDLE)
        for k in range(N_LARGE):
            request = {"cloud": {"points": cloud(N_LARGE_POINTS, k)}, "queries": [[0, 0, 1]]}
            # The first request has no parameters, so the server derives them from its cloud.
            if k > 0:
                request |= {"kernel": {"family": "matern", "length_scale": 0.3}, "alpha": 1e-6}
            body = json.dumps(request)
            # The end of the server cuts these requests off, so their failures are not kept.
            client = Soak(base, pid, 0)
            threading.Thread(target=client.call, args=("POST", "/v1/normals", body), daemon=True).start()
        time.sleep(2)
        beside = probe(soak, 10**7, until=time.monotonic() + SECONDS_BESIDE)
        os.kill(pid, signal.SIGKILL)
    return idle, beside, soak.failures


def watch(soak):
    """Records the resident memory of the server twice a second."""
    began = time.monotonic()
    while soak.goes_on():
        status = Path(f"/proc/{soak.pid}/status").read_text()
        kib = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS:"))
        soak.resident.append((time.monotonic() - began, kib << 10))
        time.sleep(0.5)


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else math.inf


def run(soak):
    soak.until = time.monotonic() + 60 * soak.minutes
    # Spawned, not forked: a copy of this process would inherit the locks of its threads.
    apart = multiprocessing.get_context("spawn").Pool(1)
    probing = apart.apply_async(probe_apart, (soak.address, soak.pid, soak.until))
    # Real clients run on other machines. A low priority leaves the cores to the server.
    os.nice(10)
    roles = [post_new_clouds] * 8 + [post_large] * 2 + [post_equal, list_clouds, list_clouds]
    roles += [read_slowly] * 8 + [send_slowly] * 2 + [leave] * 3 + [register] + [post_jobs] * 3
    threads = [threading.Thread(target=role, args=(soak, random.Random(k))) for k, role in enumerate(roles)]
    threads.append(threading.Thread(target=watch, args=(soak,)))
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    loaded, statuses, slowest, failures = probing.get()
    apart.terminate()
    soak.statuses += statuses
    soak.slowest = max(soak.slowest, slowest)
    soak.failures += failures
    return loaded


def judge(soak, idle, beside, loaded):
    """Returns the figures of a run, and the conditions that do not hold."""
    half = soak.resident[len(soak.resident) // 2 :]
    third, last = half[: len(half) // 2], half[len(half) // 2 :]
    mean = [statistics.fmean(n_bytes for _, n_bytes in part) for part in (third, last)]
    peak = max(n_bytes for _, n_bytes in soak.resident)
    figures = {
        "minutes": soak.minutes,
        "requests read to their end": sum(soak.statuses.values()),
        "by status": dict(sorted(soak.statuses.items())),
        "slowest, seconds": round(soak.slowest, 2),
        "deadline, seconds": DEADLINE,
        "budget, MiB": BUDGET >> 20,
        "peak resident, MiB": peak >> 20,
        "resident in the third quarter, MiB": int(mean[0]) >> 20,
        "resident in the last quarter, MiB": int(mean[1]) >> 20,
    }
    failures = list(soak.failures)
    for kind in ("cold", "warm"):
        for name, seconds in (("idle", idle), ("beside large work", beside), ("under load", loaded)):
            figures[f"small, {kind}, {name}: median and p99, ms"] = [
                round(1e3 * percentile(seconds[kind], share), 1) for share in (0.5, 0.99)
            ]
        ratio = percentile(beside[kind], 0.99) / percentile(idle[kind], 0.99)
        if not (ratio <= 10 or percentile(beside[kind], 0.99) <= SECONDS_OF_SLICES):
            failures.append(f"small requests, {kind}: {ratio:.1f} times as long beside large work")
    if peak > 1.1 * BUDGET:
        failures.append(f"the resident memory reached {peak / BUDGET:.2f} of the budget")
    if abs(mean[1] / mean[0] - 1) > 0.05:
        failures.append(f"the resident memory went from {mean[0]:.3g} to {mean[1]:.3g} bytes")
    return figures, failures


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("binary")
    arguments.add_argument("--minutes", type=float, default=10)
    arguments.add_argument("--report", type=Path)
    arguments = arguments.parse_args()
    idle, beside, failed = probe_beside_large_work(arguments.binary)
    with tempfile.TemporaryDirectory() as store, server(
        arguments.binary, [*FLAGS, *STORE_FLAGS, "--store", store]
    ) as (base, pid):
        soak = Soak(base, pid, arguments.minutes)
        soak.failures += failed
        loaded = run(soak)
        figures, failures = judge(soak, idle, beside, loaded)
        os.kill(pid, 0)
    for name, figure in figures.items():
        print(f"{name}: {figure}")
    if arguments.report:
        arguments.report.write_text(json.dumps(figures | {"failures": failures}, indent=2) + "\n")
    for failure in failures[:20]:
        print(f"failed: {failure}", file=sys.stderr)
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
