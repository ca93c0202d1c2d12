"""Computations as jobs: against a service of a few lines, and the real one."""

from __future__ import annotations

import json
import re
from typing import Any

import httpx
import numpy as np
import pytest

import gramian
from gramian.rest.models import Job
from gramian.tensors import Array

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
    names = ["done" if job["status"] == "succeeded" else "progress" for job in jobs]
    text = "".join(f"event: {name}\ndata: {json.dumps(job)}\n\n: \n\n" for name, job in zip(names, jobs, strict=True))
    return httpx.Response(200, text=text, headers={"Content-Type": "text/event-stream"})


class Service:
    """Answers with what it is given, in turn, and notes what it is asked."""

    def __init__(self, *answers: httpx.Response) -> None:
        self.answers = list(answers)
        self.asked: list[str] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        if request.url.path == "/v1/clouds":
            return httpx.Response(201, json=CLOUD)
        self.asked.append(f"{request.method} {request.url.path}")
        if request.method == "DELETE":
            return httpx.Response(204)
        return self.answers.pop(0)

    def cloud(self, progress: Any) -> gramian.Cloud:
        transport = httpx.MockTransport(self)
        client = gramian.Client("http://service", format="json", transport=transport, progress=progress)
        return client.cloud([[0.0, 0.0]])


ACCEPTED = httpx.Response(202, json=job("queued", 0.0), headers={"Location": PLACE})
FINISHED = [f"GET {PLACE}/result", f"DELETE {PLACE}"]


def test_a_job_is_followed_to_its_end_over_as_many_connections_as_it_takes() -> None:
    told: list[Job] = []
    refused = {"type": "/problems/invalid-cloud", "title": "", "status": 422, "detail": "none", "instance": "x"}
    service = Service(
        ACCEPTED,
        events(job("running", 0.25)),
        httpx.Response(200, json=job("running", 0.5)),
        events(job("running", 0.75), job("succeeded", 1.0)),
        httpx.Response(422, json=refused, headers={"Content-Type": "application/problem+json"}),
    )
    with pytest.raises(gramian.Problem, match="none"):
        service.cloud(told.append).normals()
    assert [state.progress.fraction for state in told] == [0.25, 0.5, 0.75, 1.0]
    followed = [f"GET {PLACE}/events", f"GET {PLACE}", f"GET {PLACE}/events"]
    assert service.asked == ["POST /v1/normals", *followed, *FINISHED]


def test_what_ends_the_wait_cancels_the_job() -> None:
    def interrupt(_: Job) -> None:
        raise KeyboardInterrupt

    service = Service(ACCEPTED, events(job("running", 0.25), job("succeeded", 1.0)))
    with pytest.raises(KeyboardInterrupt):
        service.cloud(interrupt).normals()
    assert service.asked == ["POST /v1/normals", f"GET {PLACE}/events", f"DELETE {PLACE}"]


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
