"""Computations as jobs of the service: no deadline, a progress bar, and an end on Ctrl-C."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Protocol

import httpx

from .rest.models import Job, JobStatus

if TYPE_CHECKING:
    from .transport import Connection

PREFERENCE = {"Prefer": "respond-async"}
"""Asks for a job instead of an answer (RFC 7240). A service that knows no jobs answers as always."""

REOPENING_SECONDS = 0.5
"""Between two connections to the events of one job."""


class Progress(Protocol):
    """Is told how far a job is, until it is closed."""

    def __call__(self, job: Job) -> object:
        """Takes the job as it is now."""

    def close(self) -> object:
        """Says that there is no more to tell."""


class Bar:
    """A progress bar of tqdm, in a terminal or a notebook."""

    def __init__(self, name: str) -> None:
        """Names the computation.

        Raises
        ------
        ImportError
            Without tqdm: the extra `progress` of this package has it.
        """
        from tqdm.auto import tqdm

        layout = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}{postfix}"
        self._bar = tqdm(desc=name, total=1.0, bar_format=layout)

    def __call__(self, job: Job) -> None:
        """Moves on, and says what is being done."""
        progress = job.progress
        self._bar.n = max(self._bar.n, progress.fraction)
        parts = [progress.stage]
        if isinstance(progress.seconds_left, float):
            parts.append(f"{progress.seconds_left:.0f} s left")
        if isinstance(progress.residual, float):
            parts.append(f"residual {progress.residual:.0e}")
        self._bar.set_postfix_str(", ".join(parts))

    def close(self) -> None:
        """Leaves the bar as it is."""
        self._bar.close()


class Told:
    """A function that is told."""

    def __init__(self, function: Callable[[Job], object]) -> None:
        """Takes the function."""
        self._function = function

    def __call__(self, job: Job) -> None:
        """Tells it."""
        self._function(job)

    def close(self) -> None:
        """Has nothing to close."""


def answer(
    connection: Connection,
    path: str,
    content: bytes,
    headers: dict[str, str],
    show: Callable[[str], Progress],
) -> httpx.Response:
    """Posts a request as a job, follows it, and returns the answer of the request.

    Whatever ends the wait before the job has ended, such as Ctrl-C, cancels the job.

    Raises
    ------
    Problem
        What the request itself would have been refused with.
    """
    response = connection.send("POST", path, content=content, headers=headers | PREFERENCE)
    if response.status_code != httpx.codes.ACCEPTED:
        return response
    place = response.headers["Location"]
    # Proxies send all that is about a job to the replica that has it, which is that of its cloud.
    routed = {name: value for name, value in headers.items() if name == "Gramian-Cloud"}
    try:
        progress = show(path.rsplit("/v1/", 1)[-1])
        with contextlib.closing(progress):
            for job in _followed(connection, place, routed):
                progress(job)
        return connection.send("GET", f"{place}/result", headers=routed)
    finally:
        # What was fetched need not be kept; what was not is not wanted any more.
        with contextlib.suppress(Exception):
            connection.http.delete(place, headers=routed)


def _followed(connection: Connection, place: str, headers: dict[str, str]) -> Iterator[Job]:
    """Yields the job whenever it is further, until it has ended."""
    while True:
        with contextlib.suppress(httpx.TransportError), _events(connection, place, headers) as response:
            for name, job in _jobs(response):
                yield job
                if name == "done":
                    return
        # The service has closed the connection, or another one has the job now: a look says whether it is known at all.
        job = Job.from_dict(connection.send("GET", place, headers=headers).json())
        yield job
        if job.status not in (JobStatus.QUEUED, JobStatus.RUNNING):
            return
        time.sleep(REOPENING_SECONDS)


@contextlib.contextmanager
def _events(connection: Connection, place: str, headers: dict[str, str]) -> Iterator[httpx.Response]:
    with connection.http.stream("GET", f"{place}/events", headers=headers) as response:
        yield response


def _jobs(response: httpx.Response) -> Iterator[tuple[str, Job]]:
    """Reads server-sent events; what is no event is a comment that keeps the connection open."""
    name = ""
    for line in response.iter_lines():
        field, _, value = line.partition(": ")
        if field == "event":
            name = value
        elif field == "data":
            yield name, Job.from_dict(json.loads(value))
