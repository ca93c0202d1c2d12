"""The service at an address."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn, Self, SupportsFloat, TypeVar, cast

import httpx
import numpy as np
import numpy.typing as npt

from . import rest
from .arguments.arrays import Sizes
from .arguments.fit import Whole
from .arguments.keywords import suggest_names
from .arguments.normalise import CLIENT, REQUEST, normalise
from .arguments.registration import register, register_file
from .cloud import Cloud
from .rest.models import CloudList, Job, KernelDescription, KernelList, Version
from .wire.connection import Connection
from .wire.problems import Problem
from .wire.progress import Bar, Progress, Told
from .wire.tensors import Array, Format, available_format
from .wire.transport import RetryingClient

T = TypeVar("T", CloudList, KernelList, Version)

DEFAULT_URL = "http://127.0.0.1:8080"

DEFAULT_TIMEOUT = httpx.Timeout(150.0, connect=10.0)
"""In seconds. Longer than the service's own deadline, 120 s if not configured, so that it can say what was too slow."""


@suggest_names
class Client:
    """A gramian service.

    Keeps connections open; `close()` it, or use it in a `with` statement. May be shared by threads; cannot be pickled,
    so every process makes its own.

    Parameters
    ----------
    base_url : str, optional
        Its address; if absent the environment variable `GRAMIAN_URL`, or else `http://127.0.0.1:8080`.
    api_key : str, optional
        A key, where the service wants one; if absent the environment variable `GRAMIAN_API_KEY`.
    timeout : float or httpx.Timeout, optional
        Seconds to wait for a connection, and for each next part of an answer; 10 and 150 if absent. `math.inf` for no
        limit.
    retries : int, optional
        How often a request is repeated at most, after 429, 502, 503 or a lost connection; 4 if absent.
    max_wait : float, optional
        Seconds that all waits of a request together may take; 60 if absent. `Retry-After` is honoured within them; if
        it asks for more, `Overloaded` is raised at once, with `retry_after`.
    format : str, optional
        How arrays travel, `"safetensors"` or `"json"`: the former if absent and that package is installed. The numbers
        are the same.
    progress : bool or callable, optional
        Whether computations are jobs of the service, with a progress bar for each (extra `progress`). Their deadline is
        that of jobs, a day if not configured. A service that is away meanwhile is waited for, ten minutes at most.
        Ctrl-C cancels them. A function instead is called with each state of a job, a `gramian.rest.models.Job`.
    transport : httpx.BaseTransport, optional
        Instead of the network, as in `httpx.Client`.

    Examples
    --------
    >>> with gramian.Client() as client:
    ...     client.version().name
    'gramian'
    """

    def __init__(
        self,
        base_url: str | None = None,
        *,
        api_key: str | None = None,
        timeout: SupportsFloat | httpx.Timeout | None = None,
        retries: Whole | None = None,
        max_wait: SupportsFloat | None = None,
        format: Format | None = None,  # noqa: A002
        progress: bool | Callable[[Job], object] | None = None,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        """Says where the service is; nothing is sent yet."""
        seconds = None if isinstance(timeout, httpx.Timeout) else timeout
        given = {"timeout": seconds, "retries": retries, "max_wait": max_wait, "format": format}
        bounds: dict[str, Any] = normalise(given, CLIENT)
        key = _key(api_key or os.environ.get("GRAMIAN_API_KEY"))
        http = RetryingClient(
            base_url=_url(base_url or os.environ.get("GRAMIAN_URL") or DEFAULT_URL),
            headers={"Authorization": f"Bearer {key}"} if key else {},
            timeout=timeout if isinstance(timeout, httpx.Timeout) else _timeout(bounds.get("timeout")),
            retries=bounds.get("retries", 4),
            max_wait=bounds.get("max_wait", 60.0),
            transport=transport,
        )
        self._connection = Connection(http, bounds.get("format", available_format()), _shown(progress))

    def __repr__(self) -> str:
        return f"Client({str(self._connection.http.base_url)!r})"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        return self  # as threads share it, so do the clones of an estimator

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Client cannot be pickled, since it has connections: every process makes its own")

    def close(self) -> None:
        """Closes the connections."""
        self._connection.http.close()

    @property
    def rest(self) -> rest.Client:
        """The generated client of this service, with the same connections, key and retries; closing it closes these.

        Its asyncio functions have the same key, but connections of their own and no retries.

        >>> from gramian.rest.api.process import check_ready
        >>> check_ready.sync(client=gramian.Client().rest).status
        'ok'
        """
        http = self._connection.http
        key = {name: value for name, value in http.headers.items() if name == "authorization"}
        client = rest.Client(base_url=str(http.base_url), headers=key, timeout=http.timeout)
        return client.set_httpx_client(http)

    def cloud(
        self, points: npt.ArrayLike | str | os.PathLike[str] | bytes, normals: npt.ArrayLike | None = None
    ) -> Cloud:
        """Registers points, and remembers them in case the service forgets them.

        Parameters
        ----------
        points : array_like, `[n, d]`, or str, os.PathLike or bytes
            A row of coordinates for each, also on a line: `[[0.0], [0.5]]`. Or a PLY file, as scanners write it: a path
            that ends in `.ply`, or the bytes. Its vertices are the points, with their normals. It is the service that
            reads it, so that the cloud has no `points` here.
        normals : array_like, `[n, d]`, optional
            Of any length but 0, if known: their side is the outward one. Not beside a file, which has its own.

        Examples
        --------
        >>> gramian.Client().cloud([[0, 0], [1, 0], [0, 1]])
        Cloud(id='f70083fe…', n_points=3, dimension=2)
        """
        file = _ply_file(points)
        if file is not None:
            if normals is not None:
                raise TypeError("normals are given with points: a PLY file has its own, as nx, ny and nz")
            return Cloud(self._connection, register_file(self._connection, file), file=file)
        own_points = _own_array("points", cast("npt.ArrayLike", points))
        n, d = own_points.shape
        own_normals = None if normals is None else _own_array("normals", normals, {"n": n, "d": d})
        try:
            description = register(self._connection, own_points, own_normals)
        except Problem as problem:
            if n < d:
                problem.add_note(f"Rows are points, so these are {n} of {d} coordinates each. Did you mean points.T?")
            raise
        return Cloud(self._connection, description, own_points, own_normals)

    def clouds(self, page_size: Whole | None = None) -> Iterator[Cloud]:
        """Yields the clouds registered with this key, oldest first, page by page.

        They have no points, and so cannot be posted again.

        Parameters
        ----------
        page_size : int, optional
            How many the service is asked for at a time; its own choice if absent.
        """
        asked = normalise({"page_size": page_size}, CLIENT)  # here, where the caller is: pages are asked for later
        return self._pages({"limit": asked["page_size"]} if asked else {})

    def _pages(self, parameters: dict[str, Any]) -> Iterator[Cloud]:
        while True:
            page = self._get("/v1/clouds", CloudList, parameters)
            yield from (Cloud(self._connection, description) for description in page.clouds)
            if not page.next_:
                return
            parameters["cursor"] = page.next_

    def kernels(self) -> list[KernelDescription]:
        """Lists the families of kernels, with their formulas and parameters.

        Examples
        --------
        >>> [kernel.family.value for kernel in gramian.Client().kernels()]
        ['gauss', 'laplace', 'matern', 'wendland', 'inverse_multiquadric']
        """
        return self._get("/v1/kernels", KernelList).kernels

    def version(self) -> Version:
        """Says what is running."""
        return self._get("/version", Version)

    def _get(self, path: str, kind: type[T], parameters: Mapping[str, Any] | None = None) -> T:
        return self._connection.read(kind.from_dict, self._connection.send("GET", path, params=parameters))


def _ply_file(points: object) -> bytes | None:
    """Returns the bytes of a PLY file, if that is what is given: by its path, or as they are."""
    if isinstance(points, bytes):
        return points if points.startswith(b"ply") else None
    if isinstance(points, str | os.PathLike) and str(points).lower().endswith(".ply"):
        return Path(points).read_bytes()
    return None


def _own_array(name: str, rows: npt.ArrayLike, sizes: Sizes | None = None) -> Array:
    """Returns a read-only copy of rows: the caller may change theirs, and these must stay as their id says."""
    array: Array = np.array(normalise({name: rows}, REQUEST, sizes)[name])  # always: others hand out their own buffer
    array.flags.writeable = False
    return array


def _url(address: str) -> str:
    """Returns an address that can be asked.

    Raises
    ------
    ValueError
        If it has another scheme than HTTP, or none.
    """
    try:
        url = httpx.URL(str(address).strip())
    except httpx.InvalidURL as error:
        raise ValueError(f"base_url is {address!r}, which is no address: {error}") from error
    if url.scheme not in ("http", "https") or not url.host:
        raise ValueError(f"base_url is {address!r}, and is to be as {DEFAULT_URL!r}: with http:// or https://")
    return str(url)


def _timeout(seconds: float | None) -> httpx.Timeout:
    """Returns these seconds for each part of an exchange; httpx has no infinite ones."""
    if seconds is None:
        return DEFAULT_TIMEOUT
    return httpx.Timeout(None if seconds == math.inf else seconds)


def _shown(progress: bool | Callable[[Job], object] | None) -> Callable[[str], Progress] | None:
    """Who is shown how far a job is, for each of them; nobody if there are to be none."""
    if progress is None or isinstance(progress, bool):
        return Bar if progress else None
    return lambda _: Told(progress)


def _key(key: str | None) -> str | None:
    """Returns a key that a header can have; one that is blank is none."""
    key = (key or "").strip()
    if not (key.isascii() and key.isprintable()):
        raise ValueError("api_key has characters that no header can have")
    return key or None
