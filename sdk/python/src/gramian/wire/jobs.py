"""Computations as jobs of the service: a deadline of their own, a progress bar, and an end on Ctrl-C."""

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
"""Asks for a job instead of an answer (RFC 7240). A service that knows no jobs answers as always."""

REOPENING_SECONDS = 0.5
"""Between two connections to the events of one job; while the service is away, the first pause, doubled each time."""

LONGEST_PAUSE_SECONDS = 15.0
"""Between two looks for a service that is away."""

AWAY_SECONDS = 600.0
"""How long the service may be away: a job of hours outlasts a restart, and another replica takes it up in seconds."""

PARTING_SECONDS = 5.0
"""How long whoever leaves a job waits to hear that it is deleted."""

_AWAY = (*TRY_LATER, httpx.codes.GATEWAY_TIMEOUT)


def answer(
    transport: Transport,
    path: str,
    content: bytes,
    headers: dict[str, str],
    show: Callable[[str], Progress],
) -> httpx.Response:
    """Posts a request as a job, follows it, and returns the answer of the request.

    Whatever ends the wait before the job has ended, such as Ctrl-C, cancels the job; but not a service that is away for
    longer than `AWAY_SECONDS`. An exception that leaves a job behind has a note that names it.

    Raises
    ------
    Problem
        What the request itself would have been refused with.
    httpx.TransportError
        If the service is away for too long.
    """
    # A repetition, after a lost connection or by a proxy, is the same job.
    key = {"Idempotency-Key": str(uuid.uuid4())}
    response = transport.send("POST", path, content=content, headers=headers | PREFERENCE | key)
    if response.status_code != httpx.codes.ACCEPTED:
        return response
    # Proxies send all that is about a job to the replica that has it, which is that of its cloud.
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
    job.delete()  # what was fetched need not be kept
    return answered


class _Followed:
    """A job of the service that somebody waits for."""

    def __init__(self, transport: Transport, place: str, headers: dict[str, str]) -> None:
        """Takes the path of the job, and what requests about it are to have in their heads."""
        self._transport = transport
        self._place = place
        self._headers = headers
        self._is_out_of_reach = False

    def states(self) -> Iterator[Job]:
        """Yields the job whenever it is further, until it has ended."""
        while True:
            with contextlib.suppress(httpx.TransportError), self._events() as response:
                for name, job in _jobs(response):
                    yield job
                    if name == "done":
                        return
            # The service closed the connection, or another one has the job now: a look says whether it is known at all.
            job = Job.from_dict(self.ask().json())
            yield job
            if job.status not in (JobStatus.QUEUED, JobStatus.RUNNING):
                return
            time.sleep(REOPENING_SECONDS)

    def ask(self, member: str = "") -> httpx.Response:
        """Asks for the job or a member of it, and again while the service is away: it may come back with the job."""
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
        """Cancels the job, since nobody waits for it any more; where that fails, the error says what is left."""
        is_gone = False
        try:
            # One that is out of reach is wanted still: the service may be back with it any moment.
            is_gone = not self._is_out_of_reach and self.delete()
        finally:
            if not is_gone:
                error.add_note(self._note())

    def delete(self) -> bool:
        """Cancels the job, or forgets its result; says whether it is gone."""
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
    """Says whether it is the service that is missing; a job that took too long has a 504 of its own."""
    if isinstance(error, Problem):
        return error.status in _AWAY and error.slug != "deadline-exceeded"
    return True


def _jobs(response: httpx.Response) -> Iterator[tuple[str, Job]]:
    """Reads server-sent events; what is no event is a comment that keeps the connection open."""
    name = ""
    for line in response.iter_lines():
        field, _, value = line.partition(": ")
        if field == "event":
            name = value
        elif field == "data":
            yield name, Job.from_dict(json.loads(value))
