"""Sending of requests, with retries, and with problems as exceptions."""

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
"""First wait if the service sends no `Retry-After`. Doubled from one attempt to the next."""

CLOUD_HEADER = "Gramian-Cloud"
"""Header that names the cloud of a request for proxies.

They always send it to the same replica, which has the results already computed.
"""

# Errors after which a request is repeated. Every operation of the service may be repeated: clouds are named
# by their content, all else computes or deletes, and requests for jobs have an idempotency key. A read
# timeout is not among these errors, since the service is then still busy with the first request.
_LOST_CONNECTION = (
    httpx.ConnectError,
    httpx.ConnectTimeout,
    httpx.ReadError,
    httpx.WriteError,
    httpx.RemoteProtocolError,
)


_RETRIES = "gramian.retries"
"""Name of the request extension that holds a number of repetitions for that request alone."""


class RetryingClient(httpx.Client):
    """An HTTP client that repeats requests after 429, 502, 503 and lost connections.

    It waits as long as `Retry-After` says. If all waits of a request together would exceed `max_wait`
    seconds, it does not wait at all, so that the caller learns at once. Then, and after `retries`
    repetitions, it returns the answer unchanged.
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
        self._max_wait = min(max_wait, TIMEOUT_MAX)  # a thread cannot sleep longer
        self._sleep = sleep
        self._process = os.getpid()

    def __del__(self) -> None:
        # Short scripts and notebooks close nothing. Without this, sockets would warn when they are collected.
        if not getattr(self, "is_closed", True):
            self.close()

    def send(self, request: httpx.Request, **options: Any) -> httpx.Response:  # noqa: ANN401 (those of httpx.Client.send)
        """Sends a request, and repeats it if necessary."""
        if os.getpid() != self._process:  # both would read from one socket, and get each other's answers
            raise RuntimeError("a Client cannot be used after a fork: every process makes its own")
        request.read()  # a body that is read from a file could be sent only once
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
    """Returns the seconds to wait by `Retry-After`, a number or a date. None without the header."""
    text = response.headers.get("Retry-After", "").strip()
    if text.isdecimal():
        return float(text)
    try:
        date = parsedate_to_datetime(text)
    except ValueError:
        return None
    if date.tzinfo is None:  # "-0000" means UTC from an unknown place
        date = date.replace(tzinfo=UTC)
    return max(0.0, (date - datetime.now(UTC)).total_seconds())


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


class Transport:
    """A service at an address. Threads may share it."""

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
            If there is no answer.
        """
        try:
            response = self.http.request(method, path, **options)
        except httpx.TransportError as error:
            # The message of a connection has no address, and str(error) has no notes.
            error.args = (f"{error} ({self.http.base_url})",)
            error.add_note(_advice(error, self.http.base_url))
            raise
        if not response.is_success:
            raise problem_of(response, retry_after(response))
        return response

    def delete(self, path: str, headers: dict[str, str], seconds: float) -> bool:
        """Deletes a resource in one attempt, as no caller should wait. Returns true if it is gone."""
        try:
            response = self.http.delete(path, headers=headers, timeout=seconds, extensions={_RETRIES: 0})
        except Exception:  # any error, such as a closed client, matters less than the one that led here
            return False
        return response.is_success or response.status_code == httpx.codes.NOT_FOUND


def about(cloud_id: str | None) -> dict[str, str]:
    """Returns the headers of a request about a cloud. Empty if its id is not known."""
    return {} if cloud_id is None else {CLOUD_HEADER: cloud_id}


def _advice(error: httpx.TransportError, url: httpx.URL) -> str:
    """Returns advice on what to check if there is no answer."""
    if isinstance(error, httpx.ReadTimeout):
        return f"{url} has not answered in time, see Client(timeout=…)."
    if not isinstance(error, httpx.ConnectError | httpx.ConnectTimeout):
        return f"There is no answer from {url}, see Client(base_url=…) or GRAMIAN_URL."
    host = f"{url.host}:{url.port}" if url.port else url.host
    return WAYS_ON.format(url=url, host=host)


WAYS_ON = """\
No service answers at {url}. Three ways on:
 - Let this package start one: gramian.cloud(points) without GRAMIAN_URL, or with gramian.local() as client.
 - Start one in a terminal, with the program of this package: gramian --bind {host}
 - Name another: gramian.Client("http://…"), or the environment variable GRAMIAN_URL."""
"""Advice if nothing listens at an address."""
