"""Requests about clouds, and their answers: arrays as JSON or tensors, computations as jobs if wanted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import httpx

from . import jobs
from .problems import UNREADABLE, unreadable
from .progress import Progress
from .tensors import JSON, SAFETENSORS, Format, Members, decode, encode
from .transport import Transport, about

T = TypeVar("T")


class Connection(Transport):
    """A service at an address, with the format of arrays. Threads may share it."""

    def __init__(
        self,
        http: httpx.Client,
        format: Format,  # noqa: A002
        show: Callable[[str], Progress] | None = None,
    ) -> None:
        """Takes the HTTP client (its base URL is the service), the array format, and a display for jobs."""
        super().__init__(http)
        self.format = format
        self.show = show

    def post(
        self, path: str, request: Mapping[str, object], accept: str | None = None, cloud_id: str | None = None
    ) -> httpx.Response:
        """Posts a JSON document that contains arrays.

        If `cloud_id` is given, the request goes to the replica that has that cloud.
        """
        body, media_type = encode(request, self.format)
        accepted = accept or (JSON if self.format == "json" else SAFETENSORS)
        headers = {"Content-Type": media_type, "Accept": accepted, **about(cloud_id)}
        if self.show is None or cloud_id is None:
            return self.send("POST", path, content=body, headers=headers)
        return jobs.answer(self, path, body, headers, self.show)

    def read(self, parse: Callable[[Any], T], response: httpx.Response) -> T:
        """Reads an answer in JSON.

        Raises
        ------
        Problem
            If the answer is not one of this service.
        """
        return understood(response, lambda: parse(response.json()))

    def compute(self, path: str, request: Mapping[str, object], read: Callable[[Members], T], cloud_id: str) -> T:
        """Posts a request about a cloud and reads its answer.

        Raises
        ------
        Problem
            If the request is refused, or the answer is not one of this service.
        """
        response = self.post(path, request, cloud_id=cloud_id)
        return understood(response, lambda: read(decode(response, request)))


def understood(response: httpx.Response, read: Callable[[], T]) -> T:
    """Reads an answer by `read`. Raises a `Problem` if that fails, as for the page of another service."""
    try:
        return read()
    except UNREADABLE as error:
        raise unreadable(response, error) from error
