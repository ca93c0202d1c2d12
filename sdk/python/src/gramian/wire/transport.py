"""The one place that sends requests: retries, and problems as exceptions."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from threading import TIMEOUT_MAX
from typing import Any, TypeVar

import httpx

from .problems import TRY_LATER, problem_of

T = TypeVar("T")

BACKOFF_SECONDS = 0.1
"""The first wait where the service does not say how long; doubled from one attempt to the next."""

CLOUD_HEADER = "Gramian-Cloud"
"""Names the cloud that a request is about to proxies: the replica that it is always sent to has what was computed."""

# Every operation of the service may be repeated: clouds are named by their content, all else computes or deletes, and
# requests for jobs have a key by which the service knows them again.
# Reading past the timeout is not among these, since the service is then busy with the first request still.
_LOST_CONNECTION = (
    httpx.ConnectError,
    httpx.ConnectTimeout,
    httpx.ReadError,
    httpx.WriteError,
    httpx.RemoteProtocolError,
)


_RETRIES = "gramian.retries"
"""The extension of a request that has a number of repetitions of its own."""


class RetryingClient(httpx.Client):
    """An HTTP client that tries again after 429, 502, 503 and lost connections.

    Waits as long as `Retry-After` says, and not at all if that would exceed `max_wait` seconds for all waits of a
    request together: the caller should know at once. Then, and after `retries` repetitions, the answer is returned as
    it is.
    """

    def __init__(
        self,
        *,
        retries: int,
        max_wait: float,
        sleep: Callable[[float], object] = time.sleep,
        **options: Any,  # noqa: ANN401 (those of httpx.Client)
    ) -> None:
        """Takes the bounds, the function that waits, and the options of `httpx.Client`."""
        super().__init__(**options)
        self._retries = retries
        self._max_wait = min(max_wait, TIMEOUT_MAX)  # nobody can sleep longer
        self._sleep = sleep
        self._process = os.getpid()

    def __del__(self) -> None:
        # Five lines of a notebook close nothing. Without this, sockets would warn when they are collected.
        if not getattr(self, "is_closed", True):
            self.close()

    def send(self, request: httpx.Request, **options: Any) -> httpx.Response:  # noqa: ANN401 (those of httpx.Client.send)
        """Sends a request, again if need be."""
        if os.getpid() != self._process:  # both would read from one socket, and get each other's answers
            raise RuntimeError("a Client cannot be used after a fork: every process makes its own")
        request.read()  # a body that is read from a file can be sent once only
        waited = 0.0
        for attempt in range(request.extensions.get(_RETRIES, self._retries)):
            backoff = BACKOFF_SECONDS * 2**attempt
            try:
                response = super().send(request, **options)
            except _LOST_CONNECTION:
                wait = backoff
                if waited + wait > self._max_wait:
                    raise
            else:
                if response.status_code not in TRY_LATER:
                    return response
                wait = _or(retry_after(response), backoff)
                if waited + wait > self._max_wait:
                    return response
                response.close()
            waited += wait
            self._sleep(wait)
        return super().send(request, **options)


def retry_after(response: httpx.Response) -> float | None:
    """Returns the seconds that `Retry-After` asks to wait, given as seconds or as date; None without the header."""
    text = response.headers.get("Retry-After", "").strip()
    if text.isdecimal():
        return float(text)
    try:
        date = parsedate_to_datetime(text)
    except ValueError:
        return None
    if date.tzinfo is None:  # "-0000" says: in UTC, of an unknown place
        date = date.replace(tzinfo=UTC)
    return max(0.0, (date - datetime.now(UTC)).total_seconds())


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


class Transport:
    """A service at an address. May be shared by threads."""

    def __init__(self, http: httpx.Client) -> None:
        """Takes the HTTP client, whose base URL is the service."""
        self.http = http

    def send(self, method: str, path: str, **options: Any) -> httpx.Response:  # noqa: ANN401 (those of httpx.Client.request)
        """Sends a request.

        Raises
        ------
        Problem
            If the answer is a refusal, or the redirection of a proxy.
        httpx.TransportError
            If there is none.
        """
        try:
            response = self.http.request(method, path, **options)
        except httpx.TransportError as error:
            error.add_note(_advice(error, self.http.base_url))
            raise
        if not response.is_success:
            raise problem_of(response, retry_after(response))
        return response

    def delete(self, path: str, headers: dict[str, str], seconds: float) -> bool:
        """Deletes in one attempt, since nobody is to wait for what is not wanted; says whether it is gone."""
        try:
            response = self.http.delete(path, headers=headers, timeout=seconds, extensions={_RETRIES: 0})
        except Exception:  # whatever it was, such as a closed client, what led here matters more
            return False
        return response.is_success or response.status_code == httpx.codes.NOT_FOUND


def about(cloud_id: str | None) -> dict[str, str]:
    """Returns the headers of a request about a cloud, if its id is known."""
    return {} if cloud_id is None else {CLOUD_HEADER: cloud_id}


def _advice(error: httpx.TransportError, url: httpx.URL) -> str:
    """Says what to look at where there is no answer."""
    if isinstance(error, httpx.ReadTimeout):
        return f"{url} has not answered in time, see Client(timeout=…)."
    return f"There is no answer from {url}, see Client(base_url=…) or GRAMIAN_URL."
