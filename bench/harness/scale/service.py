"""Answers of gramian over HTTP, from a new process for each piece of work."""

import http.client
import io
import json
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load, save

from ..clouds import Floats
from ..server import Client, Server
from ..setting import Setting
from .peers import Done

SAFETENSORS = "application/x-safetensors"
#: Deadline of the server in seconds. It exceeds the default, so that a slow answer is measured and not cut
#: off.
DEADLINE_SECONDS = 1_800


class NotServed(Exception):
    """Raised when the service refuses a request or does not answer."""


@dataclass(frozen=True)
class Answered(Done):
    """An answer of gramian: its members that are no arrays, seconds by stage, and bytes of the idle process."""

    members: Mapping[str, Any] = field(default_factory=dict)
    stages: Mapping[str, float] = field(default_factory=dict)
    idle_bytes: int = 0

    def member(self, name: str) -> Any:
        """Returns an array, or the list that stands for it."""
        return self.arrays[name] if name in self.arrays else self.members[name]


class Service:
    """Starts servers and sends them requests."""

    def __init__(self, setting: Setting, binary: Path, fields: Mapping[str, Any]) -> None:
        """Takes `fields`, such as a solver, which are added to every request."""
        self._environment = {**setting.environment, "GRAMIAN_DEADLINE_SECONDS": str(DEADLINE_SECONDS)}
        self._binary = binary
        self._fields = dict(fields)

    def version(self) -> dict[str, Any]:
        with self._server() as server:
            return server.version()

    def ask(
        self,
        path: str,
        points: Floats,
        request: Mapping[str, Any],
        tensors: Mapping[str, Floats] | None = None,
        n_rounds: int = 1,
    ) -> Answered:
        """Posts the cloud and the request to a new process; returns the fastest of several rounds.

        Time is from the first byte of the cloud to the last byte of the answer. After each round the cloud is
        deleted, together with everything computed from it.
        """
        try:
            with self._server() as server:
                idle = server.memory_bytes("VmRSS")
                best = min((self._once(server.client(), path, points, request, tensors) for _ in range(n_rounds)), key=_seconds)
                return replace(best, peak_bytes=server.memory_bytes("VmHWM"), idle_bytes=idle)
        except (OSError, http.client.HTTPException) as error:
            raise NotServed(f"no answer: {type(error).__name__} {error}") from error

    def _server(self) -> Server:
        return Server(self._binary, ["--bind"], self._environment)

    def _once(
        self, client: Client, path: str, points: Floats, request: Mapping[str, Any], tensors: Mapping[str, Floats] | None
    ) -> Answered:
        body = io.BytesIO()
        np.save(body, points)
        cloud = body.getvalue()
        began = time.perf_counter()
        answer = client.request("POST", "/v1/clouds", cloud, {"Content-Type": "application/x-npy"})
        if answer.status >= 300:
            raise NotServed(refusal(answer.status, answer.body))
        identifier = answer.json()["cloud_id"]
        fields = {"cloud": {"id": identifier}, **self._fields, **request}
        if tensors:
            content, kind = save(dict(tensors), metadata={"request": json.dumps(fields)}), SAFETENSORS
        else:
            content, kind = json.dumps(fields).encode(), "application/json"
        answer = client.request("POST", path, content, {"Content-Type": kind, "Accept": SAFETENSORS})
        seconds = time.perf_counter() - began
        if answer.status >= 300:
            raise NotServed(refusal(answer.status, answer.body))
        client.request("DELETE", f"/v1/clouds/{identifier}")
        return Answered(seconds, 0, load(answer.body), members_of(answer.body), answer.stages)


def members_of(body: bytes) -> dict[str, Any]:
    """Returns the members of an answer that are no arrays."""
    header = json.loads(body[8 : 8 + int.from_bytes(body[:8], "little")])
    return json.loads(header.get("__metadata__", {}).get("response", "{}"))


def refusal(status: int, body: bytes) -> str:
    """Formats status and problem in a line."""
    try:
        problem = json.loads(body)
        slug = str(problem.get("type", "")).rpartition("/")[2]
        reasons = [problem.get("detail") or "", *(f"{e.get('pointer')}: {e.get('detail')}" for e in problem.get("errors", []))]
        text = f"{slug}: {'; '.join(filter(None, reasons))}"
    except ValueError:
        text = body[:200].decode(errors="replace")
    text = " ".join(text.replace("|", "/").split())
    return f"{status} {text[:160]}"


def use_cores(n: int) -> None:
    """Restricts this process, and all that it starts, to n cores."""
    available = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, set(available[:n]))


def _seconds(work: Answered) -> float:
    return work.seconds
