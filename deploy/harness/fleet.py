"""Three replicas on one bucket, and the routers in front of them.

The configurations are the shipped files with other addresses.
"""

import re
import signal
import time
from pathlib import Path

import yaml
from processes import Failed, free_port, get, post, put

DEPLOY = Path(__file__).parent.parent
REPLICAS = ("replica-1", "replica-2", "replica-3")
# Seconds for which a draining replica waits for its clients. They are few, because clients here read at once.
DRAIN_SECONDS = "5"


class Fleet:
    """The S3 server, the replicas, and the addresses of all."""

    def __init__(self, processes, binary):
        self.processes, self.binary = processes, binary
        self.store = f"http://127.0.0.1:{free_port()}"
        self.ports = {name: free_port() for name in REPLICAS}
        self.metrics_port = free_port()

    def start(self):
        """Starts the store, then all replicas."""
        port = self.store.rsplit(":", 1)[1]
        self.processes.start(
            "s3", ["moto_server", "-H", "127.0.0.1", "-p", port], ready=f"{self.store}/moto-api/data.json"
        )
        self.make_bucket()
        for name in REPLICAS:
            self.start_replica(name)

    def make_bucket(self):
        """Creates the bucket, empty."""
        put(f"{self.store}/gramian")

    def lose_bucket(self):
        """Deletes the bucket with its contents. The store refuses writes from then on."""
        post(f"{self.store}/moto-api/reset")

    def start_replica(self, name):
        """Starts a replica, and waits until it is ready."""
        variables = {
            "GRAMIAN_BIND": f"127.0.0.1:{self.ports[name]}",
            "GRAMIAN_STORE": "s3://gramian/clouds",
            "GRAMIAN_STORE_REQUIRED": store_required(),
            "GRAMIAN_THREADS": "2",
            "GRAMIAN_MEMORY_BYTES": str(1 << 30),
            "GRAMIAN_DRAIN_SECONDS": DRAIN_SECONDS,
            "AWS_ENDPOINT": self.store,
            "AWS_ALLOW_HTTP": "true",
            "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": "test",
            "AWS_SECRET_ACCESS_KEY": "test",
        }
        self.processes.start(name, [self.binary], variables, f"{self.address(name)}/health/ready")

    def address(self, name):
        """Returns the base URL of a replica."""
        return f"http://127.0.0.1:{self.ports[name]}"

    def kill(self, name):
        """Ends a replica by SIGKILL, as a failing machine does."""
        self.processes.end(name, signal.SIGKILL)

    def drain(self, name):
        """Ends a replica in order."""
        status = self.processes.end(name)
        if status != 0:
            raise Failed(f"{name} ended with status {status}")

    def total(self, family, labels=""):
        """Returns the sum of a metric over all replicas. All must answer."""
        return sum(metric(get(f"{self.address(name)}/metrics"), family, labels) for name in REPLICAS)

    def placed(self, text):
        """Returns the text of a shipped file with the addresses of this machine."""
        for name, port in self.ports.items():
            text = text.replace(f"address: {name}, port_value: 8080", f"address: 127.0.0.1, port_value: {port}")
            text = text.replace(f"{name}:8080", f"127.0.0.1:{port}")
        return text

    def write(self, file, replacements):
        """Writes a shipped file into the directory of this run. Every replacement has to apply."""
        text = self.placed((DEPLOY / file).read_text())
        for old, new in replacements.items():
            if old not in text:
                raise Failed(f"{file} has no {old!r}")
            text = text.replace(old, new)
        path = self.processes.directory / Path(file).name
        path.write_text(text)
        return path


def store_required():
    """Returns GRAMIAN_STORE_REQUIRED of the shipped fleet.

    It decides whether a replica is ready only while the store accepts writes.
    """
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
    return services[REPLICAS[0]]["environment"]["GRAMIAN_STORE_REQUIRED"]


def wait_until(holds, what):
    """Waits until a condition holds. Raises `Failed` if it does not hold within twenty seconds."""
    until = time.monotonic() + 20
    while not holds():
        if time.monotonic() > until:
            raise Failed(f"not after 20 s: {what}")
        time.sleep(0.1)


def metric(text, family, labels=""):
    """Returns the sum of the samples of a family, in the text format, whose labels contain `labels`."""
    pattern = rf"^{family}(?:\{{([^}}]*)\}})? (\S+)$"
    return sum(float(value) for has, value in re.findall(pattern, text.decode(), re.MULTILINE) if labels in has)


class Router:
    """The common part of the three routers.

    `counts_kept_connections` is true if a failed try on a connection kept from an earlier request counts as a
    try.
    """

    counts_kept_connections = True

    def __init__(self, fleet):
        self.fleet, self.port = fleet, free_port()
        self.url = f"http://127.0.0.1:{self.port}"

    def n_repeated(self):
        """Returns the number of requests that the router has sent again, if it counts them."""
        return "not counted"


class Haproxy(Router):
    """HAProxy, the router of compose.yaml and of the chart."""

    name = "haproxy"

    def __init__(self, fleet):
        super().__init__(fleet)
        self.metrics_port = fleet.metrics_port

    def start(self):
        """Starts it with the shipped configuration."""
        replacements = {
            "bind :8080": f"bind 127.0.0.1:{self.port}",
            "bind :8404": f"bind 127.0.0.1:{self.metrics_port}",
            "/tmp/haproxy.sock": str(self.fleet.processes.directory / "haproxy.sock"),
        }
        file = self.fleet.write("haproxy/haproxy.cfg", replacements)
        self.fleet.processes.start(self.name, ["haproxy", "-db", "-f", file], ready=f"{self.url}/router/health")

    def wait_for(self, replica):
        """Waits until HAProxy sends requests to a replica again."""
        address = f"http://127.0.0.1:{self.metrics_port}/metrics"
        labels = f'proxy="by_cloud",server="{replica}",state="UP"'
        wait_until(lambda: metric(get(address), "haproxy_server_status", labels) == 1, f"haproxy takes {replica}")

    def n_repeated(self):
        """Returns the number of requests sent again, to the same replica or to another one."""
        text = get(f"http://127.0.0.1:{self.metrics_port}/metrics")
        return round(sum(metric(text, f"haproxy_backend_{how}_warnings_total") for how in ("retry", "redispatch")))


class Nginx(Router):
    """nginx, an alternative router."""

    name = "nginx"
    counts_kept_connections = False

    def start(self):
        """Starts it with the shipped configuration."""
        file = self.fleet.write(
            "nginx/nginx.conf",
            {
                "listen 8080": f"listen 127.0.0.1:{self.port}",
                "/tmp/nginx": str(self.fleet.processes.directory / "nginx"),
            },
        )
        command = ["nginx", "-c", file, "-p", self.fleet.processes.directory, "-g", "daemon off;"]
        self.fleet.processes.start(self.name, command, ready=f"{self.url}/health/live")

    def wait_for(self, replica):
        """Waits 6 s. nginx has no checks, and tries a failed replica again after fail_timeout, 5 s."""
        del replica
        time.sleep(6)


class Envoy(Router):
    """Envoy, an alternative router."""

    name = "envoy"

    def __init__(self, fleet):
        super().__init__(fleet)
        self.admin_port = free_port()

    def start(self):
        """Starts it with the shipped configuration."""
        file = self.fleet.write(
            "envoy/envoy.yaml",
            {
                "address: 0.0.0.0, port_value: 8080": f"address: 127.0.0.1, port_value: {self.port}",
                "port_value: 9901": f"port_value: {self.admin_port}",
            },
        )
        command = ["envoy", "--use-dynamic-base-id", "--concurrency", "2", "-l", "warn", "-c", file]
        self.fleet.processes.start(self.name, command, ready=f"{self.url}/health/live")
        self.wait_for(REPLICAS[-1])

    def wait_for(self, replica):
        """Waits until Envoy finds all replicas healthy, and another second for it to rebuild its ring."""
        del replica
        address = f"http://127.0.0.1:{self.admin_port}/stats?filter=replicas.membership_healthy"
        wait_until(lambda: f": {len(REPLICAS)}" in get(address).decode(), "envoy takes all replicas")
        time.sleep(1)

    def n_repeated(self):
        text = get(f"http://127.0.0.1:{self.admin_port}/stats?filter=replicas.upstream_rq_retry$").decode()
        return int(text.rsplit(" ", 1)[1])
