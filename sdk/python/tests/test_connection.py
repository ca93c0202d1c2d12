"""Failures on the way, with real sockets: no server, a dying or foreign one, proxy pages, large answers."""

from __future__ import annotations

import itertools
import json
import multiprocessing
import os
import pickle
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import httpx
import numpy as np
import pytest
from safetensors.numpy import save
from sent import CIRCLE, DESCRIPTION, ID

import gramian
from gramian.rest import models
from gramian.wire.transport import retry_after

VERSION = json.dumps({"name": "gramian", "version": "9", "api": "v1", "instruction_set": "v3", "threads": 1}).encode()
DIAGNOSTICS = {
    "cloud_id": ID,
    "n_points": 8,
    "n_queries": 1,
    "dimension": 2,
    "kernel": {"family": "gauss", "length_scale": 1.0, "variance": 1.0},
    "alpha": 0.0,
    "solver": "dense",
    "factorization": "cholesky",
    "rank": 8,
    "reciprocal_condition": 1.0,
    "relative_residual": 0.0,
    "native_norm_squared": 1.0,
    "misfit": 0.0,
    "n_merged_duplicates": 0,
    "warnings": [],
}


def http(status: str, body: bytes, *headers: str, length: int | None = None) -> bytes:
    head = [f"HTTP/1.1 {status}", f"Content-Length: {len(body) if length is None else length}", *headers]
    return "\r\n".join([*head, "", ""]).encode() + body


@contextmanager
def server(*answers: bytes | None) -> Iterator[tuple[str, list[int]]]:
    """Runs a server that answers each connection with the next of these bytes, then closes it.

    None means silence. Yields the address and a list with the number of connections.
    """
    listener = socket.create_server(("127.0.0.1", 0))
    connections = [0]
    silent = threading.Event()

    def serve() -> None:
        for answer in answers:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            with connection:
                connections[0] += 1
                read_request(connection)
                if answer is None:
                    silent.wait()
                else:
                    connection.sendall(answer)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}", connections
    finally:
        silent.set()
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join()


def read_request(connection: socket.socket) -> None:
    """Reads a whole request. Closing before its end would break the connection."""
    with connection.makefile("rb") as stream:
        length = 0
        while (line := stream.readline().lower()) not in (b"\r\n", b""):
            if line.startswith(b"content-length:"):
                length = int(line.partition(b":")[2])
        stream.read(length)


def unused_address() -> str:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return f"http://127.0.0.1:{listener.getsockname()[1]}"


def test_a_server_that_is_not_there_is_named() -> None:
    address = unused_address()
    with gramian.Client(address, retries=1) as client, pytest.raises(httpx.ConnectError) as caught:
        client.version()
    assert str(caught.value).endswith(f"({address})")
    (note,) = caught.value.__notes__
    first, *ways = note.splitlines()
    assert first == f"No service answers at {address}. Three ways on:"
    expected = ["gramian.local()", f"gramian --bind {address.removeprefix('http://')}", "GRAMIAN_URL"]
    assert all(part in way for part, way in zip(expected, ways, strict=True))


def test_an_answer_that_breaks_off_is_asked_for_again() -> None:
    half = http("200 OK", VERSION[:20], length=len(VERSION))
    with server(half, b"HTTP/1.1 20", b"", http("200 OK", VERSION)) as (address, connections):
        assert gramian.Client(address).version().version == "9"
    assert connections == [4]


def test_an_answer_that_always_breaks_off_is_an_error() -> None:
    half = http("200 OK", VERSION[:20], length=len(VERSION))
    with server(half, half) as (address, connections):
        with pytest.raises(httpx.RemoteProtocolError) as caught:
            gramian.Client(address, retries=1).version()
        assert "There is no answer from" in caught.value.__notes__[0]
    assert connections == [2]


def test_an_answer_that_does_not_come_says_which_timeout() -> None:
    with server(None) as (address, connections):
        with pytest.raises(httpx.ReadTimeout) as caught:
            gramian.Client(address, timeout=np.float32(0.2)).version()
        assert caught.value.__notes__ == [f"{address} has not answered in time, see Client(timeout=…)."]
        assert connections == [1]  # no repetition: the service is still busy with the request


PAGES: dict[str, tuple[str, bytes, str, int, str]] = {
    "a page": ("502 Bad Gateway", b"<html><h1>Bad Gateway</h1>", "text/html", 502, "<html><h1>Bad Gateway</h1>"),
    "nothing": ("502 Bad Gateway", b"", "text/html", 502, "Bad Gateway"),
    "no text": ("500 Internal Server Error", b"\xff\xfe\x00", "application/octet-stream", 500, "��\x00"),
    "another's JSON": ("404 Not Found", b'{"detail": "Not Found"}', "application/json", 404, '{"detail": "Not Found"}'),
    "JSON of other types": (
        "400 Bad Request",
        b'{"type": null, "title": 1, "status": "x", "detail": [], "instance": 0}',
        "application/json",
        400,
        '{"type": null, "title": 1, "status": "x", "detail": [], "instance": 0}',
    ),
    "a number": ("403 Forbidden", b"7", "application/json", 403, "7"),
    "deep JSON": ("403 Forbidden", b"[" * 100_000, "application/json", 403, "[" * 200),
}


@pytest.mark.parametrize(("status", "body", "media_type", "number", "detail"), PAGES.values(), ids=PAGES.keys())
def test_a_refusal_that_is_no_document_is_a_problem(
    status: str, body: bytes, media_type: str, number: int, detail: str
) -> None:
    with (
        server(http(status, body, f"Content-Type: {media_type}")) as (address, _),
        pytest.raises(gramian.Problem) as caught,
    ):
        gramian.Client(address, retries=0).version()
    problem = caught.value
    assert (problem.status, problem.slug, problem.detail) == (number, "about:blank", detail)
    assert (problem.pointer, problem.request_id, problem.point_indices) == (None, "", ())
    assert str(problem) == f"{number} about:blank: {detail}"
    assert str(pickle.loads(pickle.dumps(problem))) == str(problem)


def test_a_redirection_says_where_to() -> None:
    answer = http("308 Permanent Redirect", b"", "Location: https://elsewhere/version")
    with (
        server(answer) as (address, _),
        pytest.raises(gramian.Problem, match=r"redirected to https://elsewhere/version"),
    ):
        gramian.Client(address).version()


SUCCESSES: dict[str, tuple[bytes, str]] = {
    "a page": (b"<html>Welcome", "text/html"),
    "nothing": (b"", "application/json"),
    "another's JSON": (b'{"hello": "world"}', "application/json"),
    "a list": (b"[]", "application/json"),
    "deep JSON": (b"[" * 100_000, "application/json"),
    "no safetensors": (b"\x10\x00", "application/x-safetensors"),
    "safetensors of others": (save({"x": np.zeros(3)}), "application/x-safetensors"),
    "a safetensors header too long": ((1 << 60).to_bytes(8, "little") + b"{}", "application/x-safetensors"),
    "half of the tensors": (
        save({"values": np.zeros(100)}, {"response": json.dumps({"diagnostics": DIAGNOSTICS})})[:-8],
        "application/x-safetensors",
    ),
    "tensors of another type": (
        save({"values": np.zeros(1, "f4")}, {"response": json.dumps({"diagnostics": DIAGNOSTICS})}),
        "application/x-safetensors",
    ),
}


@pytest.mark.parametrize(("body", "media_type"), SUCCESSES.values(), ids=SUCCESSES.keys())
def test_a_success_of_another_service_is_a_problem(body: bytes, media_type: str) -> None:
    calls: list[Callable[[gramian.Client], object]] = [
        lambda client: client.version(),
        lambda client: client.kernels(),
        lambda client: list(client.clouds()),
        lambda client: client.cloud(CIRCLE),
        lambda client: listed(client).interpolate(np.ones(8)),
    ]
    for call in calls:
        answer = http("200 OK", body, f"Content-Type: {media_type}", "X-Request-Id: abc")
        with server(answer) as (address, _), pytest.raises(gramian.Problem) as caught:
            call(gramian.Client(address))
        problem = caught.value
        assert (problem.status, problem.slug, problem.title) == (200, "about:blank", "Not an answer of gramian")
        assert f"but not as gramian does ({media_type}, " in problem.detail
        assert problem.request_id == "abc"


def listed(client: gramian.Client) -> gramian.Cloud:
    return gramian.Cloud(client._connection, models.Cloud.from_dict(DESCRIPTION))


def test_a_large_answer_is_not_copied() -> None:
    n = 1_000_000
    body = save({"values": np.arange(float(n))}, {"response": json.dumps({"diagnostics": DIAGNOSTICS})})
    with server(http("200 OK", body, "Content-Type: application/x-safetensors")) as (address, _):
        answer = listed(gramian.Client(address)).interpolate(np.ones(8))
    assert answer.values.shape == (n,)
    assert answer.values[-1] == n - 1
    assert not answer.values.flags.owndata


def test_threads_that_share_a_client_have_their_own_answers() -> None:
    with gramian.Client() as client:
        clouds = [client.cloud(radius * CIRCLE) for radius in range(1, 5)]
        jobs = list(itertools.product(clouds, range(10)))
        with ThreadPoolExecutor(16) as pool:
            answers = list(pool.map(lambda job: job[0].interpolate(np.full(8, job[1]), job[0].points), jobs))
    for (cloud, value), answer in zip(jobs, answers, strict=True):
        assert answer.diagnostics.cloud_id == cloud.id
        np.testing.assert_allclose(answer.values, value, atol=1e-6)


def test_what_has_connections_says_that_it_cannot_be_pickled(client: gramian.Client, circle: Any) -> None:
    with pytest.raises(TypeError, match=r"^a Client cannot be pickled, .* every process makes its own$"):
        pickle.dumps(client)
    with pytest.raises(TypeError, match=r"^a Cloud cannot be pickled, .* its points and its answers can$"):
        pickle.dumps(client.cloud(circle))


def curvature(radius: float) -> float:
    return float(gramian.Client().cloud(radius * CIRCLE).curvatures(kernel="gauss").mean_curvatures[0])


def test_every_process_makes_its_own_client() -> None:
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        found = pool.map(curvature, [1.0, 2.0])
    assert found[0] == pytest.approx(2 * found[1], rel=1e-6)


def ask_in_a_fork(client: gramian.Client, answers: multiprocessing.SimpleQueue[str]) -> None:
    try:
        answers.put(client.version().name)
    except RuntimeError as error:
        answers.put(str(error))


def test_a_client_does_not_share_its_sockets_with_a_fork(client: gramian.Client) -> None:
    client.version()
    context = multiprocessing.get_context("fork")
    answers = context.SimpleQueue()
    child = context.Process(target=ask_in_a_fork, args=(client, answers))
    child.start()
    assert answers.get() == "a Client cannot be used after a fork: every process makes its own"
    child.join()
    assert client.version().name == "gramian"


def test_a_client_needs_no_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    address = os.environ["GRAMIAN_URL"]
    monkeypatch.setenv("GRAMIAN_URL", f" {address}\n")
    monkeypatch.setenv("GRAMIAN_API_KEY", "  ")
    with gramian.Client() as client:
        assert repr(client) == f"Client('{address}')"
        assert client.version().name == "gramian"
        assert "authorization" not in client._connection.http.headers
    with pytest.raises(RuntimeError, match=r"closed"):
        client.version()


def test_every_argument_of_a_client_may_be_none() -> None:
    names = ["base_url", "api_key", "timeout", "retries", "max_wait", "format", "progress", "transport"]
    with gramian.Client(**dict.fromkeys(names)) as client:
        assert client.version().name == "gramian"
        http = client._connection.http
        assert (http.timeout.read, http.timeout.connect) == (150, 10)


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        ({"base_url": "localhost:8080"}, ValueError, "base_url is 'localhost:8080', .* with http:// or https://"),
        ({"base_url": "127.0.0.1:8080"}, ValueError, "base_url is '127.0.0.1:8080', "),
        ({"base_url": "localhost"}, ValueError, "base_url is 'localhost', .* with http://"),
        ({"base_url": "ftp://localhost"}, ValueError, "base_url is 'ftp://localhost', .* with http://"),
        ({"base_url": "http://"}, ValueError, "base_url is 'http://', "),
        ({"base_url": "http://localhost:port"}, ValueError, "base_url is 'http://localhost:port', "),
        ({"api_key": "ключ"}, ValueError, "api_key has characters that no header can have"),
        ({"api_key": "a\nb"}, ValueError, "api_key has characters that no header can have"),
        ({"timeout": "5"}, TypeError, "timeout is to be a number, not '5'"),
        ({"timeout": -1}, ValueError, "timeout is -1.0, and times are not negative"),
        ({"retries": 2.5}, ValueError, "retries is to be a whole number, not 2.5"),
        ({"retries": True}, TypeError, "retries is to be a number, not True"),
        ({"max_wait": float("nan")}, ValueError, "max_wait is nan"),
        ({"format": "safetensor"}, ValueError, "format is 'safetensor', .*; did you mean 'safetensors'\\?"),
    ],
    ids=repr,
)
def test_what_a_client_cannot_be_is_said_at_once(arguments: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=rf"^{message}") as caught:
        gramian.Client(**arguments)
    assert arguments.get("api_key", "nothing") not in str(caught.value)


def test_numbers_of_numpy_configure_a_client() -> None:
    client = gramian.Client(
        timeout=np.array(5),
        retries=np.int64(2),
        max_wait=float("inf"),
        format=np.str_("json"),  # type: ignore[arg-type]
    )
    assert client._connection.http.timeout.read == 5
    assert client._connection.format == "json"
    client.cloud(CIRCLE)
    assert next(client.clouds(page_size=np.uint8(1))).n_points > 0
    with pytest.raises(ValueError, match=r"^page_size is to be a whole number, not 1.5$"):
        client.clouds(page_size=1.5)  # type: ignore[arg-type]


def test_times_may_be_infinite() -> None:
    with gramian.Client(timeout=float("inf"), max_wait=float("inf")) as client:
        assert client.version().name == "gramian"
    overloaded = http("503 Service Unavailable", b"", f"Retry-After: {'9' * 400}")
    with server(overloaded) as (address, _), pytest.raises(gramian.Overloaded) as caught:
        gramian.Client(address, max_wait=float("inf")).version()
    assert caught.value.retry_after == float("inf")  # nobody can wait for that


def test_a_key_is_shown_nowhere() -> None:
    client = gramian.Client(unused_address(), api_key="secret", retries=0)
    with pytest.raises(httpx.ConnectError) as caught:
        client.version()
    assert "secret" not in repr(client) + repr(caught.value) + "".join(caught.value.__notes__)


def test_transposed_points_that_are_refused_are_said_to_be() -> None:
    transposed = np.random.default_rng(1).normal(size=(3, 50))
    with pytest.raises(gramian.Problem) as caught:
        gramian.Client().cloud(transposed)
    assert caught.value.__notes__ == ["Rows are points, so these are 3 of 50 coordinates each. Did you mean points.T?"]


RETRY_AFTER: dict[str, float | None] = {
    "7": 7.0,
    " 7 ": 7.0,
    "0": 0.0,
    "Sat, 01 Jan 2000 00:00:00 GMT": 0.0,
    "Saturday, 01-Jan-00 00:00:00 GMT": 0.0,
    "Sat, 01 Jan 2000 00:00:00 -0000": 0.0,
    "": None,
    "-5": None,
    "1.5": None,
    "soon": None,
    "Sat, 99 Jan 2000 00:00:00 GMT": None,
    "Sat, 01 Jan 99999 00:00:00 GMT": None,
    "Mon, 01 Jan 0001 00:00:00 +2359": 0.0,
    "²": None,
    "9" * 400: float("inf"),
}


@pytest.mark.parametrize(("text", "seconds"), RETRY_AFTER.items())
def test_retry_after_is_read_or_ignored(text: str, seconds: float | None) -> None:
    assert retry_after(httpx.Response(503, headers={b"Retry-After": text.encode()})) == seconds
