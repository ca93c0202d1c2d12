"""The client of a gramian service."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import TracebackType
from typing import Any, NoReturn, Self, SupportsFloat, TypeVar, cast

import httpx
import numpy as np
import numpy.typing as npt

from . import rest
from .arguments.arrays import Sizes
from .arguments.files import read
from .arguments.fit import Whole
from .arguments.geometries import GeometryLike, geometry_of
from .arguments.keywords import suggest_names
from .arguments.normalise import CLIENT, REQUEST, normalise
from .arguments.registration import register, register_file
from .arguments.tables import Table, columns_of
from .resources.cloud import Cloud
from .rest.models import CloudList, Job, KernelDescription, KernelList, Version
from .wire.connection import Connection
from .wire.problems import Problem
from .wire.progress import Bar, Progress, Told
from .wire.tensors import Array, Format, available_format
from .wire.transport import RetryingClient

T = TypeVar("T", CloudList, KernelList, Version)

DEFAULT_URL = "http://127.0.0.1:8080"

DEFAULT_TIMEOUT = httpx.Timeout(150.0, connect=10.0)
"""Default timeouts in seconds.

They exceed the service's own deadline, 120 s by default, so that the service can say what was too slow.
"""


@suggest_names
class Client:
    """A gramian service.

    A client keeps connections open. `close()` it, or use it in a `with` statement. Threads may share it. It
    cannot be pickled, so every process makes its own.

    Parameters
    ----------
    base_url : str, optional
        Address of the service. If absent, the environment variable `GRAMIAN_URL`, or else
        `http://127.0.0.1:8080`.
    api_key : str, optional
        Key, if the service requires one. If absent, the environment variable `GRAMIAN_API_KEY`.
    timeout : float or httpx.Timeout, optional
        Seconds to wait for a connection, and for each next part of an answer. 10 and 150 if absent.
        `math.inf` means no limit.
    retries : int, optional
        Largest number of repetitions of a request after 429, 502, 503 or a lost connection. 4 if absent.
    max_wait : float, optional
        Seconds that all waits of a request together may take. 60 if absent. `Retry-After` is honoured within
        them. If it asks for more, `Overloaded` is raised at once, with `retry_after`.
    format : str, optional
        Format of arrays in transit, `"safetensors"` or `"json"`. The numbers are the same. If absent,
        safetensors if that package is installed.
    progress : bool or callable, optional
        True to run computations as jobs of the service, each with a progress bar (extra `progress`). Their
        deadline is that of jobs, a day by default. The client waits at most ten minutes for a service that is
        unreachable meanwhile. Ctrl-C cancels the jobs. A function is called with each state of a job, a
        `gramian.rest.models.Job`, instead of showing a bar.
    transport : httpx.BaseTransport, optional
        Transport to use instead of the network, as in `httpx.Client`.

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
        """Takes the address and the options. Nothing is sent yet."""
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
        return self  # clones of an estimator share it, as threads do

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Client cannot be pickled, since it has connections: every process makes its own")

    def close(self) -> None:
        """Closes the connections."""
        self._connection.http.close()

    @property
    def rest(self) -> rest.Client:
        """The generated client of this service, with the same connections, key and retries.

        Closing it closes these connections. Its asyncio functions have the same key, but separate connections
        and no retries.

        >>> from gramian.rest.api.process import check_ready
        >>> check_ready.sync(client=gramian.Client().rest).status
        'ok'
        """
        http = self._connection.http
        key = {name: value for name, value in http.headers.items() if name == "authorization"}
        client = rest.Client(base_url=str(http.base_url), headers=key, timeout=http.timeout)
        return client.set_httpx_client(http)

    def cloud(
        self,
        points: npt.ArrayLike | Table | GeometryLike | str | os.PathLike[str] | bytes,
        normals: npt.ArrayLike | None = None,
        *,
        columns: Sequence[str] | None = None,
    ) -> Cloud:
        """Registers points. The cloud keeps a copy of them, in case the service forgets them.

        Parameters
        ----------
        points : array_like, `[n, d]`, or str, os.PathLike or bytes
            A row of coordinates for each point, also on a line: `[[0.0], [0.5]]`. Or the path of a file: PLY,
            XYZ, CSV, PCD, LAS, npy, OBJ, STL or JSON, with its normals. Points of organised scans without a
            position are left out, with a warning. Or the bytes of a PLY file, which the service reads, so that
            the cloud has no `points` here. Arrays of other libraries are read through `__array__`. Or a mesh or
            a cloud of trimesh, PyVista or Open3D: its vertices are the points, with its normals if each vertex
            has one.
        normals : array_like, `[n, d]`, optional
            Normals of any length but 0, if known. Their side is the outward one. They replace those of a mesh.
            Not allowed with a file, which has normals itself.
        columns : sequence of str, optional
            Names of the coordinates, if `points` is a table: a DataFrame, a Dataset, a structured array or a
            dictionary of columns.

        Examples
        --------
        >>> gramian.Client().cloud([[0, 0], [1, 0], [0, 1]])
        Cloud(id='f70083fe…', n_points=3, dimension=2)
        >>> gramian.Client().cloud({"x": [0, 1, 0], "y": [0, 0, 1], "height": [3, 2, 2]}, columns=["x", "y"])
        Cloud(id='f70083fe…', n_points=3, dimension=2)
        """
        if columns is not None:
            points = columns_of(points, columns)
        if isinstance(points, str | os.PathLike | bytes) and normals is not None:
            raise TypeError("normals are given with points: a file has its own, such as nx, ny and nz")
        if isinstance(points, bytes) and points.startswith(b"ply"):
            return Cloud(self._connection, register_file(self._connection, points), file=points)
        if isinstance(points, str | os.PathLike):
            points, normals = _of_file(points)
        geometry = geometry_of(points)
        if geometry is not None:
            points, normals = geometry.positions, geometry.normals if normals is None else normals
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

        These clouds have no points here, so they cannot be posted again.

        Parameters
        ----------
        page_size : int, optional
            Number of clouds per request. The service chooses if absent.
        """
        asked = normalise({"page_size": page_size}, CLIENT)  # now, in the caller's frame; pages come later
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
        """Returns the version of the running service."""
        return self._get("/version", Version)

    def _get(self, path: str, kind: type[T], parameters: Mapping[str, Any] | None = None) -> T:
        return self._connection.read(kind.from_dict, self._connection.send("GET", path, params=parameters))


def _of_file(path: str | os.PathLike[str]) -> tuple[Array, Array | None]:
    """Returns the positions of a file, and its normals if it has some. Warns of rows that are left out."""
    found = read(path)
    if found.left_out is not None:
        warnings.warn(f"{os.fspath(path)}: {found.left_out}", stacklevel=4)  # beyond the decorator of the class
    return found.positions, found.normals


def _own_array(name: str, rows: npt.ArrayLike, sizes: Sizes | None = None) -> Array:
    """Returns a read-only copy of rows. The caller may change the original, but this must match its id."""
    array: Array = np.array(normalise({name: rows}, REQUEST, sizes)[name])  # copies the caller's buffer
    array.flags.writeable = False
    return array


def _url(address: str) -> str:
    """Returns a checked address.

    Raises
    ------
    ValueError
        If its scheme is neither `http` nor `https`, or if it has no host.
    """
    try:
        url = httpx.URL(str(address).strip())
    except httpx.InvalidURL as error:
        raise ValueError(f"base_url is {address!r}, which is no address: {error}") from error
    if url.scheme not in ("http", "https") or not url.host:
        raise ValueError(f"base_url is {address!r}, and is to be as {DEFAULT_URL!r}: with http:// or https://")
    return str(url)


def _timeout(seconds: float | None) -> httpx.Timeout:
    """Returns the timeout for each part of an exchange. Infinity becomes None, which httpx expects."""
    if seconds is None:
        return DEFAULT_TIMEOUT
    return httpx.Timeout(None if seconds == math.inf else seconds)


def _shown(progress: bool | Callable[[Job], object] | None) -> Callable[[str], Progress] | None:
    """Returns a function that makes a progress display for a job, or None if there are to be no jobs."""
    if progress is None or isinstance(progress, bool):
        return Bar if progress else None
    return lambda _: Told(progress)


def _key(key: str | None) -> str | None:
    """Returns a key that a header can carry. A blank key counts as none."""
    key = (key or "").strip()
    if not (key.isascii() and key.isprintable()):
        raise ValueError("api_key has characters that no header can have")
    return key or None
