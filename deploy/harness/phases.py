"""Phases of the test: each does something to the fleet, and checks what has to hold."""

import contextlib
import threading
import time

import httpx
from fleet import REPLICAS, metric, wait_until
from load import FIT, FIT_IN_JSON, N_POINTS, Load, Long, new_seeds, points, repeat, values
from processes import get

# Seconds of load before and after an event.
SECONDS_BEFORE, SECONDS_AFTER = 4, 6
# Seconds without store. Longer than a router waits before it takes the clouds away from a replica that is not
# ready.
SECONDS_REFUSING = 15
# SECONDS_TRUSTED: how long a cloud in memory is assumed to be in the store as well. SECONDS_SILENT: the
# longest answer allowed afterwards. The store gets a few questions, with five seconds for each answer.
SECONDS_TRUSTED, SECONDS_SILENT = 11, 25
PREPARED = "gramian_solvers_prepared_total"
REQUESTS = "gramian_http_requests_total"
RUNNING, ADMITTED = "gramian_compute_running", "gramian_compute_admitted"
UP_TO_DATE = "gramian_store_up_to_date"
N_LARGE_POINTS = 20_000


class Report:
    """Prints the figures of a run, and counts those that miss their bounds."""

    def __init__(self):
        self.began = time.monotonic()
        self.n_missed = 0

    def line(self, what, figure, holds):
        """Prints a figure, and counts it if its bound does not hold."""
        self.n_missed += not holds
        print(f"{time.monotonic() - self.began:6.0f} s  {'ok  ' if holds else 'FAIL'}  {what}: {figure}", flush=True)

    def failures(self, load):
        """Prints the first five failures of a load."""
        for failure in load.failures[:5]:
            print(f"            {failure}")


def smoke(report, router):
    """Sends a large body, a request routed by its path, inline points, and /metrics, which is not public."""
    with httpx.Client(base_url=router.url, timeout=60) as http:
        rows = points(new_seeds(), N_LARGE_POINTS).tolist()
        large = http.post("/v1/clouds", json={"points": rows})
        cloud = large.headers.get("gramian-cloud", "")
        known = http.get(f"/v1/clouds/{cloud}").status_code
        inline = http.post("/v1/normals", json={"cloud": {"points": rows[:50]}}).status_code
        metrics = http.get("/metrics").status_code
        statuses = (large.status_code, known, inline, metrics)
    size = len(large.request.content) / 2**20
    report.line(
        f"{router.name}: {size:.1f} MiB of points, by path, inline, /metrics",
        statuses,
        statuses == (201, 200, 200, 404),
    )


def leave(report, fleet, router):
    """A client leaves while a large cloud is factorized. The replica learns of it, and frees the place."""
    before = fleet.total(REQUESTS, 'status="499"')
    request = Long(router.url)
    wait_until(lambda: fleet.total(RUNNING) > 0, "a replica computes")
    # The client leaves midway: the whole work takes several seconds.
    time.sleep(0.5)
    n_running = fleet.total(RUNNING)
    request.leave()
    began = time.monotonic()
    wait_until(lambda: fleet.total(RUNNING) + fleet.total(ADMITTED) == 0, "no replica computes for a client that disconnected")
    seconds = time.monotonic() - began
    n_left = fleet.total(REQUESTS, 'status="499"') - before
    what = f"{router.name}: a client that disconnects: replicas computing, requests counted as 499, seconds until its place is free"
    figures = (f"{n_running:.0f}", f"{n_left:.0f}", f"{seconds:.1f}")
    report.line(what, ", ".join(figures), n_running > 0 and n_left == 1 and seconds < 2)


def deadly(report, fleet, router):
    """A request crashes every replica that computes it. At most two may be lost, not the whole fleet."""
    ended = []
    request = Long(router.url)
    client = threading.Thread(target=request.wait, daemon=True)
    client.start()
    while client.is_alive():
        for name in REPLICAS:
            if name not in ended and metric(get(f"{fleet.address(name)}/metrics"), RUNNING) > 0:
                fleet.kill(name)
                ended.append(name)
        time.sleep(0.05)
    for name in ended:
        fleet.start_replica(name)
    for name in ended:
        router.wait_for(name)
    what = f"{router.name}: replicas lost to a request that crashes every process that computes it"
    report.line(what, f"{len(ended)} of {len(REPLICAS)}, answered {request.outcome}", 1 <= len(ended) <= 2)


def refusing_store(report, fleet, router):
    """The store refuses writes for a while. Memory answers, and the router drops no replica because of it."""
    fleet.lose_bucket()
    with Load(router.url, retries=0) as load:
        wait_until(lambda: fleet.total(UP_TO_DATE) == 0, "no replica is up to date")
        time.sleep(SECONDS_REFUSING)
    n = load.n_answers + len(load.acknowledged) + len(load.failures)
    what = f"{router.name}: failed, the store takes nothing for {SECONDS_REFUSING} s, no retries of clients"
    report.line(what, f"{len(load.failures)} of {n}", not load.failures)
    report.failures(load)
    fleet.make_bucket()
    wait_until(lambda: fleet.total(UP_TO_DATE) == len(REPLICAS), "all replicas are up to date")
    n_lost = lost(load)
    what = f"{router.name}: acknowledged clouds that are lost, the store takes them again"
    report.line(what, f"{n_lost} of {len(load.acknowledged)}", n_lost == 0)


def silent_store(report, fleet, router):
    """The store does not answer for a while. Known and new clouds are served from memory."""
    known, new = (points(new_seeds(), N_POINTS).tolist() for _ in range(2))
    with httpx.Client(base_url=router.url, timeout=60) as client:

        def seconds(body, headers):
            began = time.monotonic()
            status = client.post("/v1/normals", json=body, headers=headers).status_code
            return status, time.monotonic() - began

        cloud = client.post("/v1/clouds", json={"points": known}).raise_for_status().headers["gramian-cloud"]
        of_known = {"cloud": {"id": cloud}, **FIT_IN_JSON}, {"Gramian-Cloud": cloud}
        first, _ = seconds(*of_known)
        time.sleep(SECONDS_TRUSTED)
        with fleet.processes.halted("s3"):
            answers = [seconds(*of_known), seconds(*of_known), seconds({"cloud": {"points": new}, **FIT_IN_JSON}, {})]
    report.line(
        f"{router.name}: status and seconds, the store is silent: a known cloud, again, a new one",
        ", ".join(f"{status} {took:.1f}" for status, took in answers),
        first == 200 and all(status == 200 and took < SECONDS_SILENT for status, took in answers),
    )
    wait_until(lambda: fleet.total(UP_TO_DATE) == len(REPLICAS), "all replicas are up to date")


def hit_rate(report, fleet, router, n_clouds=40, n_requests=30):
    """Clients repeat requests. These find their factor, which is made once in the whole fleet."""
    before = fleet.total(PREPARED)
    load = repeat(router.url, n_clouds, n_requests)
    n_made = fleet.total(PREPARED) - before
    n, n_hits = load.cached.total(), load.cached["gramian; hit"]
    share, possible = n_hits / n, 1 - n_clouds / n
    what = f"{router.name}: hits of {n} requests for {n_clouds} clouds"
    report.line(what, f"{share:.1%} ({possible:.1%} possible)", share >= 0.95)
    report.line(f"{router.name}: factors made for {n_clouds} clouds", f"{n_made:.0f}", n_made == n_clouds)
    report.line(f"{router.name}: failed", f"{len(load.failures)} of {n}", not load.failures)
    report.failures(load)


def kill(report, fleet, router):
    """A replica is killed under load and restarted.

    No request fails after retries, and no acknowledged cloud is lost.
    """
    victim = REPLICAS[1]
    with Load(router.url, retries=4) as load:
        time.sleep(SECONDS_BEFORE)
        fleet.kill(victim)
        time.sleep(SECONDS_AFTER)
        fleet.start_replica(victim)
        router.wait_for(victim)
        time.sleep(SECONDS_AFTER)
    n = load.n_answers + len(load.acknowledged) + len(load.failures)
    n_refused, n_cut = load.n_repeated()
    report.line(f"{router.name}: failed, one replica killed", f"{len(load.failures)} of {n}", not load.failures)
    print(f"                      the router repeated: {router.n_repeated()}", end="; ")
    print(f"clients repeated: {n_refused} refusals, {n_cut} lost connections")
    report.failures(load)
    n_back = metric(get(f"{fleet.address(victim)}/metrics"), PREPARED)
    report.line(f"{router.name}: factors made by the replica since it is back", f"{n_back:.0f}", n_back > 0)
    n_lost = lost(load)
    report.line(
        f"{router.name}: acknowledged clouds that are lost", f"{n_lost} of {len(load.acknowledged)}", n_lost == 0
    )


def lost(load):
    """Counts the acknowledged clouds that can no longer be used by their id alone."""
    n_lost = 0
    with httpx.Client(base_url=load.url, timeout=60) as http:
        for seed, cloud in load.acknowledged.items():
            kernel = {"family": "matern", "length_scale": 0.4}
            known = values(points(seed)).tolist()
            request = {"cloud": {"id": cloud}, "values": known, "kernel": kernel, "alpha": FIT["alpha"]}
            request["queries"] = [[0.0, 0.0, 1.0]]
            response = http.post("/v1/interpolation", json=request, headers={"Gramian-Cloud": cloud})
            n_lost += response.status_code != 200
    return n_lost


def rolling_restart(report, fleet, router):
    """All replicas are replaced in turn under load. No request fails, without retries of the clients."""
    with Load(router.url, retries=0) as load:
        time.sleep(SECONDS_BEFORE)
        for name in REPLICAS:
            fleet.drain(name)
            fleet.start_replica(name)
            router.wait_for(name)
        time.sleep(SECONDS_BEFORE)
    n = load.n_answers + len(load.acknowledged) + len(load.failures)
    what = f"{router.name}: failed, all replicas replaced in turn, no retries of clients"
    report.line(what, f"{len(load.failures)} of {n}", not load.failures)
    print(f"                      the router has repeated in all: {router.n_repeated()}")
    report.failures(load)


@contextlib.contextmanager
def running(fleet, router):
    """Runs a router until the block ends."""
    router.start()
    yield router
    fleet.processes.end(router.name)
