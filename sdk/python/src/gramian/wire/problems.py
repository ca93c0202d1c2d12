"""Refusals of the service as exceptions."""

from __future__ import annotations

from typing import TypeVar

import httpx

from ..rest import models
from ..rest.models import FieldError
from ..rest.types import Unset

T = TypeVar("T")


class Problem(Exception):
    """Raised when a request is refused or cannot be answered.

    Carries the problem document (RFC 9457) of the service. If a proxy or another service answered, the
    document has the type `about:blank`. `str()` says what happened, where, and the remedy if there is one.

    Examples
    --------
    >>> cloud = gramian.Client().cloud([[1, 0], [0, 1], [-1, 0], [0, -1]])
    >>> try:
    ...     cloud.curvatures(alpha=-1)
    ... except gramian.Problem as problem:
    ...     problem.status, problem.slug, problem.pointer
    (422, 'invalid-request', '/alpha')
    """

    def __init__(self, document: models.Problem, retry_after: float | None = None) -> None:
        """Takes the document, and the seconds of the header `Retry-After` if there was one."""
        super().__init__(document, retry_after)
        self.document = document
        self.retry_after = retry_after

    def __str__(self) -> str:
        lines = [f"{self.status} {self.slug}: {self.detail}"]
        # A single field usually repeats the detail of the problem. Then only its place is shown.
        lines += [
            f"  at {error.pointer}" + ("" if error.detail == self.detail else f": {error.detail}")
            for error in self.errors
        ]
        if self.request_id:
            lines.append(f"  request {self.request_id}")
        return "\n".join(dict.fromkeys(lines))  # points of a cloud given by id share a pointer

    @property
    def slug(self) -> str:
        """The kind of problem, such as `invalid-request`. The service explains it at `/problems/<slug>`."""
        return self.document.type_.rpartition("/")[2]

    @property
    def status(self) -> int:
        """The HTTP status."""
        return self.document.status

    @property
    def title(self) -> str:
        """The kind of problem in words."""
        return self.document.title

    @property
    def detail(self) -> str:
        """The explanation: what happened, where, and the remedy if there is one."""
        return self.document.detail

    @property
    def errors(self) -> tuple[FieldError, ...]:
        """The refused fields, each with `pointer` and `detail`."""
        return tuple(self.document.errors or ())

    @property
    def pointer(self) -> str | None:
        """The first refused field, as JSON pointer into the request: `/cloud/points/17/2`."""
        return self.errors[0].pointer if self.errors else None

    @property
    def minimum_alpha(self) -> float | None:
        """An `alpha` for which the computation succeeds, unit of the values squared."""
        return _given(self.document.minimum_alpha)

    @property
    def point_indices(self) -> tuple[int, ...]:
        """The points in question, by position in the cloud. At most the first 1,000."""
        return tuple(self.document.point_indices or ())

    @property
    def limit(self) -> int | None:
        """The limit that was exceeded, in the unit that `detail` names."""
        return _given(self.document.limit)

    @property
    def required(self) -> int | None:
        """The size that the request would have needed, in the unit of `limit`."""
        return _given(self.document.required)

    @property
    def request_id(self) -> str:
        """The id of the request, for the logs of the service."""
        return self.document.instance


class UnknownCloud(Problem):
    """Raised when the service does not know the cloud, or no longer.

    The points are not available here, or the service forgot them again at once.
    """


class NotPositiveDefinite(Problem):
    """Raised when K + αI is too close to singular for the request.

    `minimum_alpha` may say which `alpha` helps.
    """


class Overloaded(Problem):
    """Raised when the service is full (503) or limits the rate (429) for longer than `max_wait`."""


_KINDS: dict[str, type[Problem]] = {
    "unknown-cloud": UnknownCloud,
    "not-positive-definite": NotPositiveDefinite,
}
MAX_QUOTED = 200
"""Number of bytes of a foreign page that are quoted."""

_OVERLOADED = (httpx.codes.TOO_MANY_REQUESTS, httpx.codes.SERVICE_UNAVAILABLE)
TRY_LATER = (*_OVERLOADED, httpx.codes.BAD_GATEWAY)
"""Statuses after which the same request may succeed. 502 comes from a proxy that lost its connection."""


def problem_of(response: httpx.Response, retry_after: float | None = None) -> Problem:
    """Returns the exception for an answer that is no success."""
    document = _document(response)
    # The status decides, since a proxy may answer without a document.
    if response.status_code in _OVERLOADED:
        return Overloaded(document, retry_after)
    kind = _KINDS.get(document.type_.rpartition("/")[2], Problem)
    return kind(document, retry_after)


def unreadable(response: httpx.Response, error: Exception) -> Problem:
    """Returns the exception for an unreadable success: another service answered, or a part is lost."""
    media_type = response.headers.get("Content-Type", "no Content-Type")
    detail = (
        f"{response.url.copy_with(query=None)} answered {response.status_code}, but not as gramian does ({media_type}, "
        f"{type(error).__name__}: {error}); is base_url right?"
    )
    return Problem(_written(response, "Not an answer of gramian", detail))


UNREADABLE = (AttributeError, LookupError, RecursionError, TypeError, ValueError)
"""Exceptions raised by reading a document of an unexpected form."""


def _document(response: httpx.Response) -> models.Problem:
    """Reads the problem document, or makes one for a foreign answer, such as a proxy's page in HTML."""
    try:
        document = models.Problem.from_dict(response.json())
        for text in (document.type_, document.title, document.detail, document.instance):
            text.encode()
        document.status + 0
    except UNREADABLE:
        text = response.content[:MAX_QUOTED].decode(errors="replace")
        if response.has_redirect_location:
            text = f"redirected to {response.headers['Location']}; give the service's own address as base_url"
        return _written(response, response.reason_phrase, text or response.reason_phrase)
    return document


def _written(response: httpx.Response, title: str, detail: str) -> models.Problem:
    """Makes a problem document where the service has sent none."""
    return models.Problem(
        type_="about:blank",
        title=title,
        status=response.status_code,
        detail=detail,
        instance=response.headers.get("X-Request-Id", ""),
    )


def _given(member: T | Unset) -> T | None:
    return None if isinstance(member, Unset) else member
