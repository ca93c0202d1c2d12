"""Concurrent clients, and the outcomes of their requests."""

import http.client
import itertools
import json
import math
import random
import threading
import time
from collections import Counter

import gramian
import httpx
import numpy as np

N_CLIENTS = 8
N_POINTS, N_MANY_POINTS = 120, 1500
# Number of points of a request that takes seconds of work, and half of the memory of a replica here. A
# replica learns after a second that a client has ended its half of a connection.
N_LONG_POINTS = 11_000
FIT = {"kernel": gramian.Kernel("matern", length_scale=0.4), "alpha": 1e-6}
FIT_IN_JSON = {"kernel": {"family": "matern", "length_scale": 0.4}, "alpha": 1e-6}
GOLDEN = math.pi * (1 + math.sqrt(5))


def new_seeds():
    """Returns the first of a range of seeds that no other part of the run uses."""
    return next(_MILLIONS) * 999_999


_MILLIONS = itertools.count(1)


def points(seed, n=None):
    """Returns points on a sphere that is unique to the seed.

    Every third sphere is larger and takes a moment to factorize, so that work is always under way.
    """
    n = n or (N_POINTS if seed % 3 else N_MANY_POINTS)
    z = 1 - (2 * np.arange(n) + 1) / n
    angles = GOLDEN * np.arange(n)
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(angles), r * np.sin(angles), z]) * (1 + 1e-9 * seed)


def values(cloud_points):
    """Returns values to interpolate."""
    return np.sin(3 * cloud_points[:, 0]) + cloud_points[:, 2]


class Long:
    """A request on which a replica works for seconds. Its client does not retry."""

    def __init__(self, url):
        cloud_points = points(new_seeds(), N_LONG_POINTS)
        with httpx.Client(base_url=url, timeout=60) as registering:
            response = registering.post("/v1/clouds", json={"points": cloud_points.tolist()})
        cloud = response.raise_for_status().headers["gramian-cloud"]
        request = {"cloud": {"id": cloud}, "values": values(cloud_points).tolist(), "queries": [[0.0, 0.0, 1.0]]}
        request |= {**FIT_IN_JSON, "solver": "dense"}
        headers = {"Content-Type": "application/json", "Gramian-Cloud": cloud}
        self.outcome = None
        self._connection = http.client.HTTPConnection(url.removeprefix("http://"), timeout=120)
        self._connection.request("POST", "/v1/interpolation", json.dumps(request), headers)

    def leave(self):
        """Closes the connection without waiting for an answer."""
        self._connection.close()

    def wait(self):
        """Waits for the answer. `outcome` is then its status, or the name of the error."""
        try:
            self.outcome = self._connection.getresponse().status
        except (OSError, http.client.HTTPException) as error:
            self.outcome = type(error).__name__


class Load:
    """Clients under load, and counts of their answers, cache outcomes, refusals and failures."""

    def __init__(self, url, retries):
        self.url, self.retries = url, retries
        self.lock = threading.Lock()
        self.statuses, self.cached = Counter(), Counter()
        self.failures, self.acknowledged = [], {}
        self.n_answers = self.n_attempts = 0
        self._first = new_seeds()
        self._end = threading.Event()
        self._threads = []

    def client(self):
        """Returns a client of the package. Every attempt counts, including the client's own retries."""
        client = gramian.Client(self.url, retries=self.retries, max_wait=60, timeout=60)
        hooks = client.rest.get_httpx_client().event_hooks
        hooks["request"].append(self._count_attempt)
        hooks["response"].append(self._count)
        return client

    def _count_attempt(self, request):
        del request
        with self.lock:
            self.n_attempts += 1

    def _count(self, response):
        with self.lock:
            self.statuses[response.status_code] += 1
            if "cache-status" in response.headers:
                self.cached[response.headers["cache-status"]] += 1

    def n_repeated(self):
        """Returns the numbers of attempts that ended with an error status, and that ended without a status.

        Each of these attempts was repeated, or is a failure.
        """
        refused = sum(count for status, count in self.statuses.items() if status >= 400)
        return refused, self.n_attempts - self.statuses.total()

    def register(self, client, seed):
        """Registers a cloud, and records that the service acknowledged it."""
        cloud = client.cloud(points(seed))
        with self.lock:
            self.acknowledged[seed] = cloud.id
        return cloud

    def ask(self, cloud):
        """Interpolates values at the points of a cloud, and checks the answer against them."""
        known = values(cloud.points)
        answer = cloud.interpolate(known, cloud.points[:20], **FIT)
        if not np.allclose(answer.values, known[:20], atol=1e-3):
            raise ValueError("wrong numbers")
        with self.lock:
            self.n_answers += 1

    def attempt(self, action, *arguments):
        """Runs an action of a client. Errors that it raises count as failures."""
        try:
            return action(*arguments)
        except (gramian.Problem, httpx.TransportError, ValueError) as error:
            with self.lock:
                self.failures.append(f"{type(error).__name__}: {error}"[:200])
            time.sleep(0.05)
            return None

    def work(self, work):
        """Starts `work(client, source)` in one thread per client."""

        def run(number):
            with self.client() as client:
                work(client, random.Random(number))

        self._threads = [threading.Thread(target=run, args=(k,), daemon=True) for k in range(N_CLIENTS)]
        for thread in self._threads:
            thread.start()

    def wait(self):
        """Waits for all clients."""
        for thread in self._threads:
            thread.join()

    def __enter__(self):
        """Starts clients, which ask about clouds and at times register new ones, until the block ends."""
        self.work(self._keep_asking)
        return self

    def __exit__(self, *_):
        self._end.set()
        self.wait()

    def _keep_asking(self, client, source):
        clouds = []
        while not self._end.is_set():
            if len(clouds) < 5 or source.random() < 0.05:
                cloud = self.attempt(self.register, client, self._first + source.randrange(10**6))
                clouds += [cloud] if cloud else []
            else:
                self.attempt(self.ask, source.choice(clouds))
            time.sleep(0.01)


def repeat(url, n_clouds, n_requests):
    """Sends n_requests requests for each of n_clouds clouds, in random order, by all clients concurrently."""
    load = Load(url, retries=4)
    with load.client() as client:
        clouds = [load.register(client, new_seeds() + 1) for _ in range(n_clouds)]
    requests = [k for k in range(n_clouds) for _ in range(n_requests)]
    random.Random(1).shuffle(requests)

    def work(client, source):
        del source
        own = [gramian.Cloud(client._connection, cloud.description, cloud.points) for cloud in clouds]
        while True:
            with load.lock:
                if not requests:
                    return
                k = requests.pop()
            load.attempt(load.ask, own[k])

    load.work(work)
    load.wait()
    return load
