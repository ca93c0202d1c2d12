"""Computations as jobs, against a service of a few lines and against the real one."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

import httpx
import numpy as np
import pytest

import gramian
from gramian.rest.models import Job
from gramian.wire.tensors import Array

PLACE = "/v1/jobs/0193a5e7-8c1d-7b22-9f0e-5d3c6f1a2b4c"
CLOUD = {
    "cloud_id": "ab" * 32,
    "n_points": 1,
    "dimension": 2,
    "bounding_box": {"min": [0.0, 0.0], "max": [0.0, 0.0]},
    "n_duplicates": 0,
    "created_at": "2026-01-01T00:00:00Z",
}


def job(status: str, fraction: float) -> dict[str, Any]:
    progress = {"stage": "factor", "fraction": fraction, "seconds_left": 3.0, "residual": 1e-12}
    return {
        "job_id": PLACE.rsplit("/", 1)[1],
        "status": status,
        "progress": progress,
        "created_at": "2026-01-01T00:00:00Z",
    }


def events(*jobs: dict[str, Any]) -> httpx.Response:
    names = ["done" if job["status"] in ("succeeded", "failed") else "progress" for job in jobs]
    text = "".join(f"event: {name}\ndata: {json.dumps(job)}\n\n: \n\n" for name, job in zip(names, jobs, strict=True))
    return httpx.Response(200, text=text, headers={"Content-Type": "text/event-stream"})


Answer = httpx.Response | BaseException


class Service:
    """A service that gives these answers in turn, and repeats the last one. Records the requests."""

    def __init__(self, *answers: Answer, deleted: Answer | None = None) -> None:
        self.answers = list(answers)
        self.deleted = deleted or httpx.Response(204)
        self.asked: list[str] = []
        self.keys: list[str | None] = []
        self.timeouts: list[dict[str, float]] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        path = request.url.path.removeprefix("/below")
        if path == "/v1/clouds":
            return httpx.Response(201, json=CLOUD)
        self.asked.append(f"{request.method} {path}")
        if request.method == "POST":
            self.keys.append(request.headers.get("Idempotency-Key"))
        self.timeouts.append(request.extensions["timeout"])
        answer = self.deleted
        if request.method != "DELETE":
            answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def cloud(self, progress: Any, retries: int = 4) -> gramian.Cloud:
        transport = httpx.MockTransport(self)
        client = gramian.Client(
            "http://service/below", format="json", retries=retries, transport=transport, progress=progress
        )
        return client.cloud([[0.0, 0.0]])


class Clock:
    """A clock that advances only while a caller sleeps."""

    def __init__(self) -> None:
        self.waits: list[float] = []

    def sleep(self, seconds: float) -> None:
        self.waits.append(seconds)

    def monotonic(self) -> float:
        return sum(self.waits)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("gramian.wire.jobs.time", clock)
    return clock


ACCEPTED = httpx.Response(202, json=job("queued", 0.0), headers={"Location": PLACE})
FINISHED = [f"GET {PLACE}/result", f"DELETE {PLACE}"]
LEFT = (
    f"The job {PLACE.rsplit('/', 1)[1]} may run on. GET http://service/below{PLACE} says how far it is, "
    f"GET http://service/below{PLACE}/result is its answer, and DELETE http://service/below{PLACE} ends it, "
    f"with the header Gramian-Cloud: {CLOUD['cloud_id']}."
)


def refusal(status: int, kind: str, **headers: str) -> httpx.Response:
    document = {"type": f"/problems/{kind}", "title": "", "status": status, "detail": "none", "instance": "x"}
    return httpx.Response(status, json=document, headers={"Content-Type": "application/problem+json", **headers})


def interrupt(_: Job) -> None:
    raise KeyboardInterrupt


def test_a_job_is_followed_to_its_end_over_as_many_connections_as_it_takes(clock: Clock) -> None:
    told: list[Job] = []
    service = Service(
        ACCEPTED,
        events(job("running", 0.25)),
        httpx.Response(200, json=job("running", 0.5)),
        events(job("running", 0.75), job("succeeded", 1.0)),
        refusal(422, "invalid-cloud"),
    )
    with pytest.raises(gramian.Problem, match="none"):
        service.cloud(told.append).normals()
    assert [state.progress.fraction for state in told] == [0.25, 0.5, 0.75, 1.0]
    followed = [f"GET {PLACE}/events", f"GET {PLACE}", f"GET {PLACE}/events"]
    assert service.asked == ["POST /v1/normals", *followed, *FINISHED]
    assert clock.waits == [0.5]


def test_a_request_that_is_repeated_has_the_same_key_and_another_one_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gramian.wire.transport.BACKOFF_SECONDS", 0.0)
    told = [events(job("succeeded", 1.0)), refusal(422, "invalid-cloud")]
    lost: list[Answer] = [
        httpx.ReadError("gone"),
        httpx.RemoteProtocolError("cut"),
        refusal(503, "overloaded", **{"Retry-After": "0"}),
    ]
    service = Service(*lost, ACCEPTED, *told, ACCEPTED, *told)
    cloud = service.cloud(lambda _: None)
    for _ in range(2):
        with pytest.raises(gramian.Problem, match="none"):
            cloud.normals()
    first, *repeated, second = service.keys
    assert first is not None
    assert second is not None
    assert repeated == [first] * 3
    assert second != first
    assert len(first) <= 255


AWAY: dict[str, Callable[[], Answer]] = {
    "refused": lambda: httpx.ConnectError("gone"),
    "silent": lambda: httpx.ReadTimeout("slow"),
    "draining": lambda: refusal(503, "overloaded"),
    "limited": lambda: refusal(429, "rate-limited"),
    "proxied": lambda: httpx.Response(502, text="<html>Bad Gateway"),
    "silent behind a proxy": lambda: httpx.Response(504, text="<html>Gateway Time-out"),
}


@pytest.mark.parametrize("away", AWAY.values(), ids=AWAY.keys())
def test_a_job_outlasts_a_service_that_is_away(away: Callable[[], Answer], clock: Clock) -> None:
    service = Service(
        ACCEPTED,
        events(job("running", 0.25)),
        *[away() for _ in range(8)],
        httpx.Response(200, json=job("running", 0.5)),
        events(job("succeeded", 1.0)),
        *[away() for _ in range(2)],
        refusal(422, "invalid-cloud"),
    )
    with pytest.raises(gramian.Problem, match="none") as caught:
        service.cloud(lambda _: None, retries=0).normals()
    assert not hasattr(caught.value, "__notes__")
    looks, results = [f"GET {PLACE}"] * 9, [f"GET {PLACE}/result"] * 2
    followed = [f"GET {PLACE}/events", *looks, f"GET {PLACE}/events"]
    assert service.asked == ["POST /v1/normals", *followed, *results, *FINISHED]
    assert clock.waits == [0.5, 1, 2, 4, 8, 15, 15, 15, 0.5, 0.5, 1]


@pytest.mark.parametrize("away", AWAY.values(), ids=AWAY.keys())
@pytest.mark.parametrize("ended", [False, True])
def test_a_job_is_left_to_a_service_that_stays_away(away: Callable[[], Answer], ended: bool, clock: Clock) -> None:
    service = Service(ACCEPTED, events(job("succeeded" if ended else "running", 1.0)), away())
    with pytest.raises((httpx.TransportError, gramian.Problem)) as caught:
        service.cloud(lambda _: None, retries=0).normals()
    assert f"DELETE {PLACE}" not in service.asked
    assert caught.value.__notes__[-1] == LEFT
    assert 585 < clock.monotonic() <= 600


def test_a_service_that_says_for_how_long_it_is_away_is_taken_at_its_word(clock: Clock) -> None:
    answers = [refusal(503, "overloaded", **{"Retry-After": seconds}) for seconds in ("40", "0", "700")]
    service = Service(ACCEPTED, events(job("running", 0.25)), *answers)
    with pytest.raises(gramian.Overloaded) as caught:
        service.cloud(lambda _: None, retries=0).normals()
    assert (clock.waits, caught.value.retry_after, caught.value.__notes__) == ([40, 1], 700, [LEFT])


def test_a_job_that_took_too_long_has_ended(clock: Clock) -> None:
    service = Service(ACCEPTED, events(job("failed", 1.0)), refusal(504, "deadline-exceeded"))
    with pytest.raises(gramian.Problem, match="none"):
        service.cloud(lambda _: None).normals()
    assert service.asked == ["POST /v1/normals", f"GET {PLACE}/events", *FINISHED]
    assert clock.waits == []


@pytest.mark.parametrize("status", [204, 404])
def test_what_ends_the_wait_cancels_the_job(status: int) -> None:
    deleted = httpx.Response(status)
    service = Service(ACCEPTED, events(job("running", 0.25), job("succeeded", 1.0)), deleted=deleted)
    with pytest.raises(KeyboardInterrupt) as caught:
        service.cloud(interrupt).normals()
    assert service.asked == ["POST /v1/normals", f"GET {PLACE}/events", f"DELETE {PLACE}"]
    assert not hasattr(caught.value, "__notes__")


@pytest.mark.parametrize("deleted", [refusal(503, "overloaded"), httpx.ReadError("gone"), httpx.ReadTimeout("slow")])
def test_a_job_that_cannot_be_cancelled_is_named(deleted: Answer) -> None:
    service = Service(ACCEPTED, events(job("running", 0.25)), deleted=deleted)
    with pytest.raises(KeyboardInterrupt) as caught:
        service.cloud(interrupt).normals()
    assert caught.value.__notes__ == [LEFT]
    assert service.asked == ["POST /v1/normals", f"GET {PLACE}/events", f"DELETE {PLACE}"]  # one attempt
    assert set(service.timeouts[-1].values()) == {5}


def test_who_is_too_impatient_to_cancel_is_told_of_the_job() -> None:
    service = Service(ACCEPTED, events(job("running", 0.25)), deleted=KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt) as caught:
        service.cloud(interrupt).normals()
    assert caught.value.__context__ is not None
    assert caught.value.__context__.__notes__ == [LEFT]


@pytest.mark.parametrize("deleted", [refusal(503, "overloaded"), httpx.ReadError("gone")])
def test_an_answer_that_is_there_does_not_wait_until_its_job_is_deleted(deleted: Answer) -> None:
    result = httpx.Response(200, json={})
    service = Service(ACCEPTED, events(job("succeeded", 1.0)), result, deleted=deleted)
    connection = service.cloud(lambda _: None)._connection
    assert connection.post("/v1/normals", {}, cloud_id="ab").json() == {}
    assert service.asked == ["POST /v1/normals", f"GET {PLACE}/events", *FINISHED]


def test_a_bar_shows_what_is_done_and_how_long_it_takes(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    problem = httpx.Response(500, json={})
    service = Service(ACCEPTED, events(job("running", 0.25), job("succeeded", 1.0)), problem)
    with pytest.raises(gramian.Problem):
        service.cloud(True).normals()
    shown = capsys.readouterr().err
    assert re.search(r"normals:  25%.*factor, 3 s left, residual 1e-12", shown), shown
    assert "normals: 100%" in shown


@pytest.mark.parametrize("format", ["json", "safetensors"])
def test_answers_are_those_without_jobs(circle: Array, format: Any) -> None:  # noqa: A002
    if format == "safetensors":
        pytest.importorskip("safetensors")
    told: list[Job] = []
    kernel = gramian.Kernel("gauss", length_scale=1.5)
    with gramian.Client(format=format, progress=told.append) as jobs, gramian.Client(format=format) as plain:
        found, expected = (client.cloud(circle).curvatures(kernel=kernel, alpha=1e-6) for client in (jobs, plain))
        np.testing.assert_array_equal(found.principal_curvatures, expected.principal_curvatures)
        assert told[-1].status == "succeeded"
        with pytest.raises(gramian.Problem) as refused:
            jobs.cloud(circle).curvatures(kernel=gramian.Kernel("gauss", length_scale=-1))
        assert refused.value.status == 422
