"""A server under measurement, and a client on one raw keep-alive connection."""

import http.client
import json
import socket
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import orjson

STAGES_OF_COMPUTATION = ("parse", "gram", "factor", "solve", "evaluate")


@dataclass(frozen=True)
class Answer:
    """A response, with the seconds from the first byte sent to the last byte read."""

    status: int
    headers: Mapping[str, str]
    body: bytes
    seconds: float

    @property
    def stages(self) -> dict[str, float]:
        """Returns the entries of Server-Timing, in seconds."""
        entries = [entry.partition(";dur=") for entry in self.headers.get("server-timing", "").split(",") if entry]
        return {name.strip(): float(milliseconds) / 1e3 for name, _, milliseconds in entries}

    def json(self) -> Any:
        return orjson.loads(self.body)


class Refused(RuntimeError):
    """Raised when a request is answered with a status other than success."""


class Client:
    """A client with one keep-alive connection.

    `request` takes encoded bodies: the caller decides whether encoding is timed.
    """

    def __init__(self, port: int) -> None:
        self._connection = http.client.HTTPConnection("127.0.0.1", port)

    def request(self, method: str, path: str, body: bytes | None = None, headers: Mapping[str, str] | None = None) -> Answer:
        """Sends a request and returns the answer, whatever its status."""
        sent = {"Content-Type": "application/json", **(headers or {})} if body is not None else dict(headers or {})
        began = time.perf_counter()
        self._connection.request(method, path, body, sent)
        response = self._connection.getresponse()
        content = response.read()
        seconds = time.perf_counter() - began
        if response.status >= 400:
            # The server closes the connection after refusing a request whose body it has not read.
            self._connection.close()
        names = {name.lower(): value for name, value in response.getheaders()}
        return Answer(response.status, names, content, seconds)

    def post(self, path: str, request: Any, headers: Mapping[str, str] | None = None) -> Answer:
        """Posts JSON. Raises `Refused` unless the status is one of success."""
        answer = self.request("POST", path, encode(request), headers)
        if answer.status >= 300:
            raise Refused(f"{answer.status} {answer.body[:300].decode(errors='replace')}")
        return answer

    def forget(self, answer: Answer) -> None:
        """Deletes the cloud of an answer, together with everything computed from it."""
        self.request("DELETE", f"/v1/clouds/{answer.json()['diagnostics']['cloud_id']}")


def encode(request: Any) -> bytes:
    """Encodes JSON with every float exact. NumPy arrays become arrays of numbers."""
    return orjson.dumps(request, option=orjson.OPT_SERIALIZE_NUMPY)


class Server:
    """A process that listens on a free port until the end of the `with` block."""

    def __init__(self, binary: Path, arguments: Sequence[str], environment: Mapping[str, str], more: Sequence[str] = ()) -> None:
        """Starts `binary ARGUMENTS ADDRESS MORE`."""
        self.port = _free_port()
        command = [str(binary), *arguments, f"127.0.0.1:{self.port}", *more]
        self._process = subprocess.Popen(command, env=dict(environment), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._wait_until_ready()

    def client(self) -> Client:
        return Client(self.port)

    def version(self) -> dict[str, Any]:
        return json.loads(self.client().request("GET", "/version").body)

    def reset_peak_bytes(self) -> None:
        Path(f"/proc/{self._process.pid}/clear_refs").write_text("5")

    def memory_bytes(self, field: str) -> int:
        """Returns `VmHWM` (the peak of the resident set since the last reset) or `VmRSS`."""
        lines = Path(f"/proc/{self._process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(field + ":"))

    def _wait_until_ready(self) -> None:
        for _ in range(200):
            try:
                if self.client().request("GET", "/health/ready").status == 200:
                    return
            except OSError:
                time.sleep(0.05)
        self._process.kill()
        raise RuntimeError(f"{self._process.args!r} does not answer")

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._process.terminate()
        try:
            self._process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self._process.kill()


def _free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]
