"""The service at an address."""

from __future__ import annotations

import os
from collections.abc import Iterator
from types import TracebackType
from typing import Self

import httpx
import numpy.typing as npt

from . import rest
from .cloud import Cloud
from .registration import own_copy, register
from .rest.models import CloudList, KernelDescription, KernelList, Version
from .tensors import Format, available_format
from .transport import Connection, RetryingClient

DEFAULT_URL = "http://127.0.0.1:8080"

DEFAULT_TIMEOUT = httpx.Timeout(150.0, connect=10.0)
"""In seconds. Longer than the service's own deadline, 120 s if not configured, so that it can say what was too slow."""


class Client:
    """A gramian service.

    Keeps connections open; `close()` it, or use it in a `with` statement. May be shared by threads; cannot be pickled,
    so every process makes its own.

    >>> with gramian.Client() as client:
    ...     client.version().name
    'gramian'
    """

    def __init__(
        self,
        base_url: str | None = None,
        *,
        api_key: str | None = None,
        timeout: float | httpx.Timeout = DEFAULT_TIMEOUT,
        retries: int = 4,
        max_wait: float = 60.0,
        format: Format | None = None,  # noqa: A002
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        """Says where the service is; nothing is sent yet.

        Args:
            base_url: Its address; if absent the environment variable `GRAMIAN_URL`, or else `http://127.0.0.1:8080`.
            api_key: A key, where the service wants one; if absent the environment variable `GRAMIAN_API_KEY`.
            timeout: Seconds to wait for a connection, and for each next part of an answer; 10 and 150 if absent.
            retries: How often a request is repeated at most, after 429, 503 or a lost connection.
            max_wait: Seconds that all waits of a request together may take. `Retry-After` is honoured within them; if
                it asks for more, `Overloaded` is raised at once, with `retry_after`.
            format: How arrays travel: `"safetensors"` if that package is installed, else `"json"`. The numbers are the
                same.
            transport: Instead of the network, as in `httpx.Client`.
        """
        key = api_key or os.environ.get("GRAMIAN_API_KEY")
        http = RetryingClient(
            base_url=base_url or os.environ.get("GRAMIAN_URL") or DEFAULT_URL,
            headers={"Authorization": f"Bearer {key}"} if key else {},
            timeout=timeout,
            retries=retries,
            max_wait=max_wait,
            transport=transport,
        )
        self._connection = Connection(http, format or available_format())

    def __repr__(self) -> str:
        return f"Client({str(self._connection.http.base_url)!r})"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

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

    def cloud(self, points: npt.ArrayLike, normals: npt.ArrayLike | None = None) -> Cloud:
        """Registers points, and remembers them in case the service forgets them.

        Args:
            points: `[n, d]`, a row of coordinates for each.
            normals: `[n, d]`, of any length but 0, if known: their side is the outward one.

        >>> gramian.Client().cloud([[0, 0], [1, 0], [0, 1]])
        Cloud(id='f70083fe…', n_points=3, dimension=2)
        """
        own_points = own_copy("points", points)
        own_normals = None if normals is None else own_copy("normals", normals)
        description = register(self._connection, own_points, own_normals)
        return Cloud(self._connection, description, own_points, own_normals)

    def clouds(self, page_size: int | None = None) -> Iterator[Cloud]:
        """Yields the clouds registered with this key, oldest first, page by page.

        They have no points, and so cannot be posted again.
        """
        parameters: dict[str, str | int] = {} if page_size is None else {"limit": page_size}
        while True:
            response = self._connection.send("GET", "/v1/clouds", params=parameters)
            page = CloudList.from_dict(response.json())
            yield from (Cloud(self._connection, description) for description in page.clouds)
            if not page.next_:
                return
            parameters["cursor"] = page.next_

    def kernels(self) -> list[KernelDescription]:
        """Lists the families of kernels, with their formulas and parameters.

        >>> [kernel.family.value for kernel in gramian.Client().kernels()]
        ['gauss', 'laplace', 'matern', 'wendland', 'inverse_multiquadric']
        """
        return KernelList.from_dict(self._connection.send("GET", "/v1/kernels").json()).kernels

    def version(self) -> Version:
        """Says what is running."""
        return Version.from_dict(self._connection.send("GET", "/version").json())
