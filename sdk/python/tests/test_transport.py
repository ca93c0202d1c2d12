"""Retries, against mock services. Nothing waits."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime

import httpx
import numpy as np
import pytest

import gramian
from gramian.rest.api.process import get_version
from gramian.rest.models import Version
from gramian.wire.connection import Connection
from gramian.wire.tensors import JSON, SAFETENSORS
from gramian.wire.transport import RetryingClient

OK = {"name": "gramian", "version": "0.1.0", "api": "v1", "instruction_set": "v3", "threads": 1}
OVERLOADED = {
    "type": "/problems/overloaded",
    "title": "The service is overloaded",
    "status": 503,
    "detail": "all places in the queue are taken; try again in 7 s",
    "instance": "some-id",
}

Answer = httpx.Response | httpx.TransportError


def refusal(status: int = 503, retry_after: str | None = None) -> httpx.Response:
    headers = {} if retry_after is None else {"Retry-After": retry_after}
    return httpx.Response(status, json={**OVERLOADED, "status": status}, headers=headers)


def service(*answers: Answer) -> tuple[Callable[[httpx.Request], httpx.Response], list[httpx.Request]]:
    """Returns a service that gives these answers in turn, and the list of its requests."""
    requests: list[httpx.Request] = []
    rest: Iterator[Answer] = iter(answers)

    def handle(request: httpx.Request) -> httpx.Response:
        requests.append(request)
        answer = next(rest)
        if isinstance(answer, httpx.TransportError):
            raise answer
        return answer

    return handle, requests


def connect(
    handle: Callable[[httpx.Request], httpx.Response], retries: int = 4, max_wait: float = 60.0
) -> tuple[Connection, list[float]]:
    waits: list[float] = []
    http = RetryingClient(
        base_url="http://service",
        retries=retries,
        max_wait=max_wait,
        sleep=waits.append,
        transport=httpx.MockTransport(handle),
    )
    return Connection(http, "json"), waits


@pytest.mark.parametrize("status", [429, 503])
def test_retry_after_in_seconds_is_honoured(status: int) -> None:
    handle, requests = service(refusal(status, "7"), refusal(status, "2"), httpx.Response(200, json=OK))
    connection, waits = connect(handle)
    assert connection.send("GET", "/version").json() == OK
    assert (waits, len(requests)) == ([7.0, 2.0], 3)


def test_retry_after_as_a_date_is_honoured() -> None:
    date = format_datetime(datetime.now(UTC) + timedelta(seconds=20), usegmt=True)
    past = format_datetime(datetime.now(UTC) - timedelta(seconds=20), usegmt=True)
    handle, _ = service(refusal(503, date), refusal(503, past), httpx.Response(200, json=OK))
    connection, waits = connect(handle)
    connection.send("GET", "/version")
    assert 15 < waits[0] <= 20  # the date has whole seconds, and the machine may be slow
    assert waits[1] == 0


def test_without_a_readable_retry_after_waits_double() -> None:
    answers = [refusal(), refusal(503, "soon"), refusal(503, ""), httpx.Response(200, json=OK)]
    handle, _ = service(*answers)
    connection, waits = connect(handle)
    connection.send("GET", "/version")
    assert waits == [0.1, 0.2, 0.4]


def test_attempts_are_bounded() -> None:
    handle, requests = service(*[refusal(503, "1")] * 3)
    connection, waits = connect(handle, retries=2)
    with pytest.raises(gramian.Overloaded) as caught:
        connection.send("GET", "/version")
    assert (waits, len(requests)) == ([1.0, 1.0], 3)
    assert caught.value.retry_after == 1.0
    assert caught.value.request_id == "some-id"


def test_waits_are_bounded() -> None:
    handle, requests = service(refusal(503, "25"), refusal(503, "36"))
    connection, waits = connect(handle)
    with pytest.raises(gramian.Overloaded) as caught:
        connection.send("GET", "/version")
    assert (waits, len(requests), caught.value.retry_after) == ([25.0], 2, 36.0)


@pytest.mark.parametrize("lost", [httpx.ConnectError, httpx.ReadError, httpx.RemoteProtocolError])
def test_lost_connections_are_tried_again(lost: type[httpx.TransportError]) -> None:
    handle, requests = service(lost("gone"), httpx.Response(200, json=OK))
    connection, waits = connect(handle)
    connection.post("/v1/normals", {"cloud": {"id": "a"}})
    assert waits == [0.1]
    assert requests[0].content == requests[1].content


def test_a_connection_that_a_proxy_lost_is_tried_again() -> None:
    handle, requests = service(*[httpx.Response(502, text="<html>Bad Gateway")] * 4)
    connection, waits = connect(handle, retries=3)
    with pytest.raises(gramian.Problem) as caught:
        connection.post("/v1/normals", {"cloud": {"id": "a"}})
    assert (waits, len(requests)) == ([0.1, 0.2, 0.4], 4)
    assert (caught.value.status, type(caught.value)) == (502, gramian.Problem)  # not `Overloaded`


def test_a_request_without_arrays_needs_no_safetensors() -> None:
    handle, requests = service(httpx.Response(200, json=OK), httpx.Response(200, json=OK))
    http = httpx.Client(base_url="http://service", transport=httpx.MockTransport(handle))
    connection = Connection(http, "safetensors")
    connection.post("/v1/normals", {"cloud": {"id": "a"}})
    connection.post("/v1/normals", {"cloud": {"id": "a"}, "queries": np.zeros((1, 2))})
    assert [request.headers["Content-Type"] for request in requests] == [JSON, SAFETENSORS]
    assert [request.headers["Accept"] for request in requests] == [SAFETENSORS] * 2
    assert requests[0].read() == b'{"cloud": {"id": "a"}}'


def test_a_connection_lost_too_often_is_an_error() -> None:
    handle, requests = service(*[httpx.ConnectError("gone")] * 3)
    connection, _ = connect(handle, retries=2)
    with pytest.raises(httpx.ConnectError) as caught:
        connection.send("GET", "/version")
    assert len(requests) == 3
    assert "No service answers at http://service" in caught.value.__notes__[0]
    handle, requests = service(httpx.ConnectError("gone"))
    connection, waits = connect(handle, max_wait=0.05)
    with pytest.raises(httpx.ConnectError):
        connection.send("GET", "/version")
    assert (waits, len(requests)) == ([], 1)


@pytest.mark.parametrize(
    ("answer", "is_gone"),
    [(httpx.Response(204), True), (refusal(404), True), (refusal(503, "1"), False), (httpx.ReadError("gone"), False)],
)
def test_what_is_not_wanted_any_more_is_deleted_in_one_attempt(answer: Answer, is_gone: bool) -> None:
    handle, requests = service(answer)
    connection, waits = connect(handle)
    assert connection.delete("/v1/jobs/a", {"Gramian-Cloud": "b"}, 3.0) == is_gone
    assert (waits, requests[0].headers["Gramian-Cloud"]) == ([], "b")
    assert set(requests[0].extensions["timeout"].values()) == {3.0}


def test_timeouts_and_other_refusals_are_not_tried_again() -> None:
    handle, requests = service(httpx.ReadTimeout("slow"), refusal(504), refusal(404))
    connection, waits = connect(handle)
    with pytest.raises(httpx.ReadTimeout):
        connection.send("GET", "/version")
    with pytest.raises(gramian.Problem):
        connection.send("GET", "/version")
    assert (waits, len(requests)) == ([], 2)


def test_a_body_from_a_file_is_sent_again() -> None:
    handle, requests = service(refusal(503, "1"), httpx.Response(200, json=OK))
    connection, _ = connect(handle)
    connection.send("POST", "/v1/clouds", content=io.BytesIO(b"points"))
    assert [request.content for request in requests] == [b"points", b"points"]


def test_the_generated_client_has_the_same_retries_and_key() -> None:
    handle, requests = service(refusal(503, "0"), httpx.Response(200, json=OK))
    client = gramian.Client("http://service", api_key="secret", transport=httpx.MockTransport(handle))
    version = get_version.sync(client=client.rest)
    assert isinstance(version, Version)
    assert version.name == "gramian"
    assert [request.headers["Authorization"] for request in requests] == ["Bearer secret"] * 2


def test_address_and_key_come_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRAMIAN_URL", "http://elsewhere:1234/below")
    monkeypatch.setenv("GRAMIAN_API_KEY", "secret")
    handle, requests = service(httpx.Response(200, json=OK))
    gramian.Client(transport=httpx.MockTransport(handle)).version()
    assert str(requests[0].url) == "http://elsewhere:1234/below/version"
    assert requests[0].headers["Authorization"] == "Bearer secret"
    monkeypatch.delenv("GRAMIAN_URL")
    assert repr(gramian.Client()) == "Client('http://127.0.0.1:8080')"


def test_what_is_no_problem_document_is_a_problem_still() -> None:
    handle, _ = service(httpx.Response(502, text="<html>Bad Gateway"), httpx.Response(500, json=["what"]))
    client = gramian.Client("http://service", retries=0, transport=httpx.MockTransport(handle))
    for status, detail in [(502, "<html>Bad Gateway"), (500, '["what"]')]:
        with pytest.raises(gramian.Problem) as caught:
            client.version()
        assert (caught.value.status, caught.value.detail) == (status, detail)
        assert (caught.value.pointer, caught.value.minimum_alpha, caught.value.limit) == (None, None, None)


def test_what_is_no_success_is_a_problem_whoever_says_it() -> None:
    handle, _ = service(httpx.Response(503, text="<h1>busy</h1>"), httpx.Response(308, headers={"Location": "/"}))
    connection, _ = connect(handle, retries=0)
    with pytest.raises(gramian.Overloaded):
        connection.send("GET", "/version")
    with pytest.raises(gramian.Problem) as caught:
        connection.send("GET", "/version")
    assert caught.value.status == 308
