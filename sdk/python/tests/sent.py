"""Bodies that calls send, captured without a service."""

from __future__ import annotations

import json
from typing import Any

import httpx
import numpy as np
import pytest

import gramian
from gramian.rest import models

CIRCLE = np.column_stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)])
VALUES = np.arange(8.0)
LISTS = np.stack([VALUES, VALUES[::-1] ** 2, np.cos(VALUES)])
ID = "ab" * 32

DESCRIPTION = {
    "cloud_id": ID,
    "n_points": 8,
    "dimension": 2,
    "bounding_box": {"min": [-1, -1], "max": [1, 1]},
    "n_duplicates": 0,
    "created_at": "2026-01-01T00:00:00Z",
}

# Every method that computes, with its required arguments.
METHODS: dict[str, dict[str, Any]] = {
    "interpolate": {"values": VALUES},
    "posterior": {"values": VALUES},
    "interpolate_batch": {"values": LISTS},
    "posterior_batch": {"values": LISTS},
    "select_model": {"values": VALUES},
    "normals": {},
    "curvatures": {},
    "surface_gradient": {"values": VALUES},
    "surface_gradient_matrix": {},
    "surface_gradient_sparse_matrix": {},
    "laplace_beltrami": {"values": VALUES},
    "laplace_beltrami_matrix": {},
    "laplace_beltrami_sparse_matrix": {},
}
QUERYING = [method for method in METHODS if method != "select_model"]
BATCHES = [method for method in METHODS if method.endswith("_batch")]
OPERATORS = [method for method in METHODS if "surface_gradient" in method or "laplace" in method]
SURFACES = ["normals", "curvatures", *OPERATORS]


class Sent(Exception):
    """Raised instead of sending a request. Carries its body."""

    def __init__(self, request: httpx.Request) -> None:
        super().__init__(request.url.path)
        self.body: Any = json.loads(request.content)


def recorded(request: httpx.Request) -> httpx.Response:
    raise Sent(request)


def client() -> Any:
    return gramian.Client("http://service", format="json", transport=httpx.MockTransport(recorded))


def cloud() -> Any:
    """Returns a cloud of eight points in the plane, whose service raises `Sent` with what it is sent."""
    return gramian.Cloud(client()._connection, models.Cloud.from_dict(DESCRIPTION))


def sent(method: str, **arguments: object) -> Any:
    """Returns the body that a call of a method sends, without the cloud."""
    with pytest.raises(Sent) as caught:
        getattr(cloud(), method)(**{**METHODS[method], **arguments})
    assert caught.value.body.pop("cloud") == {"id": ID}
    return caught.value.body


def posted(points: object, normals: object = None) -> Any:
    """Returns the body that registering points sends."""
    with pytest.raises(Sent) as caught:
        client().cloud(points, normals)
    return caught.value.body
