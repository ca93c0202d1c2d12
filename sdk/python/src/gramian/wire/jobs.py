"""Computations as jobs of the service: a separate deadline, a progress bar, and cancellation on Ctrl-C."""

from __future__ import annotations

import contextlib
import json
import time
import uuid
from collections.abc import Callable, Iterator

import httpx

from ..rest.models import Job, JobStatus
from .problems import TRY_LATER, Problem
from .progress import Progress
from .transport import Transport

PREFERENCE = {"Prefer": "respond-async"}
"""Header that asks for a job instead of an answer (RFC 7240). A service without jobs answers as always."""

REOPENING_SECONDS = 0.5
"""Pause between two connections to the events of a job.

Also the first pause while the service is away, doubled each time.
"""

LONGEST_PAUSE_SECONDS = 15.0
"""Longest pause between two requests to a service that is away."""

AWAY_SECONDS = 600.0
"""Longest absence of the service, in seconds.

A job of hours outlasts a restart, and another replica takes it up in seconds.
"""

PARTING_SECONDS = 5.0
"""Longest wait for the deletion of an abandoned job."""

_AWAY = (*TRY_LATER, httpx.codes.GATEWAY_TIMEOUT)


def answer(
    transport: Transport,
    path: str,
    content: bytes,
    headers: dict[str, str],
    show: Callable[[str], Progress],
) -> httpx.Response:
    """Posts a request as a job, follows it, and returns the answer of the request.

    An exception that ends the wait early, such as Ctrl-C, cancels the job. Only if the service is away for
    longer than `AWAY_SECONDS` is the job not cancelled. An exception that leaves a job behind has a note that
    names the job.

    Raises
    ------
    Problem
        If the request is refused, with the same problem as without a job.
    httpx.TransportError
        If the service is away for too long.
    """
    # With this key, a repetition after a lost connection or by a proxy refers to the same job.
    key = {"Idempotency-Key": str(uuid.uuid4())}
    response = transport.send("POST", path, content=content, headers=headers | PREFERENCE | key)
    if response.status_code != httpx.codes.ACCEPTED:
        return response
    # With this header, proxies send requests about a job to the replica that has it, which is that of its
    # cloud.
    routed = {name: value for name, value in headers.items() if name == "Gramian-Cloud"}
    job = _Followed(transport, response.headers["Location"], routed)
    try:
        progress = show(path.rsplit("/v1/", 1)[-1])
        with contextlib.closing(progress):
            for state in job.states():
                progress(state)
        answered = job.ask("/result")
    except BaseException as error:
        job.leave(error)
        raise
    job.delete()  # the service need not keep a fetched result
    return answered


class _Followed:
    """A job of the service for which a caller waits."""

    def __init__(self, transport: Transport, place: str, headers: dict[str, str]) -> None:
        """Takes the path of the job, and the headers of requests about it."""
        self._transport = transport
        self._place = place
        self._headers = headers
        self._is_out_of_reach = False

    def states(self) -> Iterator[Job]:
        """Yields the job whenever it has progressed, until it has ended."""
        while True:
            with contextlib.suppress(httpx.TransportError), self._events() as response:
                for name, job in _jobs(response):
                    yield job
                    if name == "done":
                        return
            # The service closed the connection, or another replica has the job now. A request for the job
            # tells whether it still exists.
            job = Job.from_dict(self.ask().json())
            yield job
            if job.status not in (JobStatus.QUEUED, JobStatus.RUNNING):
                return
            time.sleep(REOPENING_SECONDS)

    def ask(self, member: str = "") -> httpx.Response:
        """Requests the job or a member of it. Repeats while the service is away: it may come back with it."""
        pause, last = REOPENING_SECONDS, time.monotonic() + AWAY_SECONDS
        while True:
            try:
                return self._transport.send("GET", self._place + member, headers=self._headers)
            except (httpx.TransportError, Problem) as error:
                if not _is_away(error):
                    raise
                wait = max(pause, getattr(error, "retry_after", None) or 0.0)
                if time.monotonic() + wait > last:
                    self._is_out_of_reach = True
                    raise
            time.sleep(wait)
            pause = min(2 * pause, LONGEST_PAUSE_SECONDS)

    def leave(self, error: BaseException) -> None:
        """Cancels the job, since no caller waits for it. If that fails, adds a note about it to the error."""
        is_gone = False
        try:
            # A job out of reach is still wanted: the service may return with it at any moment.
            is_gone = not self._is_out_of_reach and self.delete()
        finally:
            if not is_gone:
                error.add_note(self._note())

    def delete(self) -> bool:
        """Cancels the job, or deletes its result. Returns true if it is gone."""
        return self._transport.delete(self._place, self._headers, PARTING_SECONDS)

    def _note(self) -> str:
        url = self._transport.http.build_request("GET", self._place).url
        job_id = self._place.rsplit("/", 1)[-1]
        routed = "".join(f", with the header {name}: {value}" for name, value in self._headers.items())
        return (
            f"The job {job_id} may run on. GET {url} says how far it is, GET {url}/result is its answer, and "
            f"DELETE {url} ends it{routed}."
        )

    @contextlib.contextmanager
    def _events(self) -> Iterator[httpx.Response]:
        with self._transport.http.stream("GET", f"{self._place}/events", headers=self._headers) as response:
            yield response


def _is_away(error: httpx.TransportError | Problem) -> bool:
    """Returns true if the error means that the service is away. A 504 for an overlong job does not."""
    if isinstance(error, Problem):
        return error.status in _AWAY and error.slug != "deadline-exceeded"
    return True


def _jobs(response: httpx.Response) -> Iterator[tuple[str, Job]]:
    """Reads server-sent events. Skips comments, which only keep the connection open."""
    name = ""
    for line in response.iter_lines():
        field, _, value = line.partition(": ")
        if field == "event":
            name = value
        elif field == "data":
            yield name, Job.from_dict(json.loads(value))
