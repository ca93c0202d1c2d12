"""The header that names the cloud of a request, so that a proxy finds its replica. Without a service."""

from __future__ import annotations

from typing import Any

import httpx
import numpy as np
import pytest
from sent import CIRCLE, DESCRIPTION, ID, METHODS

import gramian
from gramian.rest import models
from gramian.wire.transport import CLOUD_HEADER

OTHER = "cd" * 32
UNKNOWN = {"type": "/problems/unknown-cloud", "title": "", "status": 404, "detail": "", "instance": "some-id"}
FILE = b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n"


def recording(*known: str) -> tuple[gramian.Client, list[tuple[str, str, str | None]]]:
    """Returns a client, and a list that records each request: method, path and cloud header.

    Its service knows only the clouds `known`, by their paths.
    """
    asked: list[tuple[str, str, str | None]] = []

    def handle(request: httpx.Request) -> httpx.Response:
        path = request.url.path
        asked.append((request.method, path, request.headers.get(CLOUD_HEADER)))
        if path == "/v1/clouds":
            return httpx.Response(201, json=DESCRIPTION)
        return httpx.Response(204) if path in known else httpx.Response(404, json=UNKNOWN)

    client = gramian.Client("http://service", format="json", transport=httpx.MockTransport(handle))
    return client, asked


@pytest.mark.parametrize("method", METHODS)
def test_every_computation_says_which_cloud_it_is_about(method: str) -> None:
    client, asked = recording()
    cloud: Any = gramian.Cloud(client._connection, models.Cloud.from_dict(DESCRIPTION))
    with pytest.raises(gramian.UnknownCloud):
        getattr(cloud, method)(**METHODS[method])
    assert [about for _, _, about in asked] == [ID]


def test_a_deletion_says_it_too() -> None:
    client, asked = recording(f"/v1/clouds/{ID}")
    gramian.Cloud(client._connection, models.Cloud.from_dict(DESCRIPTION)).delete()
    assert asked == [("DELETE", f"/v1/clouds/{ID}", ID)]


def test_other_requests_are_about_no_cloud() -> None:
    client, asked = recording()
    client.cloud(CIRCLE)
    with pytest.raises(gramian.Problem):
        client.version()
    assert asked == [("POST", "/v1/clouds", None), ("GET", "/version", None)]


@pytest.mark.parametrize("points", [CIRCLE, FILE], ids=["points", "file"])
def test_what_is_posted_again_goes_to_the_same_replica(points: Any) -> None:
    client, asked = recording()
    cloud = client.cloud(points)
    with pytest.raises(gramian.UnknownCloud):
        cloud.normals()
    first, *again = asked
    assert first == ("POST", "/v1/clouds", None)
    assert again == [("POST", "/v1/normals", ID), ("POST", "/v1/clouds", ID), ("POST", "/v1/normals", ID)]


def test_the_cloud_of_the_surface_is_posted_where_it_is_asked_for() -> None:
    client, asked = recording()
    description = models.Cloud.from_dict({**DESCRIPTION, "cloud_id": OTHER})
    cloud = gramian.Cloud(client._connection, description, CIRCLE)
    surface = client.cloud(2 * CIRCLE)
    with pytest.raises(gramian.UnknownCloud):
        cloud.laplace_beltrami(np.ones(8), surface=surface)
    assert [(path, about) for _, path, about in asked[1:]] == [
        ("/v1/laplace-beltrami", OTHER),
        ("/v1/clouds", OTHER),
        ("/v1/clouds", OTHER),
        ("/v1/laplace-beltrami", OTHER),
    ]
