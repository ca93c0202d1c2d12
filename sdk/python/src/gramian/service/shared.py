"""The service of those who name none: that at `GRAMIAN_URL`, or one that runs as long as this interpreter."""

from __future__ import annotations

import atexit
import os
import threading
from collections.abc import Sequence

import numpy.typing as npt

from ..arguments.geometries import GeometryLike
from ..arguments.tables import Table
from ..client import Client
from ..resources.cloud import Cloud
from .process import LocalService
from .program import find_program


class SharedClients:
    """The clients that an interpreter keeps, one for each address, and its local service. Threads may share it."""

    def __init__(self) -> None:
        """Begins without a client and without a service."""
        self._lock = threading.Lock()
        self._clients: dict[tuple[str, str | None], Client] = {}
        self._service: LocalService | None = None

    def client(self, address: str | None) -> Client:
        """Returns the client of an address, if absent of `GRAMIAN_URL`, or else of the local service."""
        with self._lock:
            url = address or os.environ.get("GRAMIAN_URL") or self._local_url()
            key = os.environ.get("GRAMIAN_API_KEY")
            if (url, key) not in self._clients:
                self._clients[url, key] = Client(url, api_key=key)
            return self._clients[url, key]

    def _local_url(self) -> str:
        if self._service and not self._service.is_running():
            self._service.stop()
            self._service = None
        self._service = self._service or LocalService(find_program())
        return self._service.url

    def close(self) -> None:
        """Ends the local service. To be called when the interpreter ends."""
        for client in self._clients.values():
            client.close()
        if self._service:
            self._service.stop()

    def forget(self) -> None:
        """Begins anew. To be called in a child after a fork, where another thread may have held the lock."""
        if self._service:
            self._service.leave()
        self._lock = threading.Lock()
        self._clients = {}
        self._service = None


_shared = SharedClients()
atexit.register(_shared.close)
if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_shared.forget)


def shared_client(address: str | None = None) -> Client:
    """Returns the shared client of this process for an address. It keeps its connections.

    Parameters
    ----------
    address : str, optional
        Address of a service. If absent, `GRAMIAN_URL`, or else that of a local service, which is started at
        the first call and ends with the interpreter.
    """
    return _shared.client(address)


def cloud(
    points: npt.ArrayLike | Table | GeometryLike | str | os.PathLike[str] | bytes,
    normals: npt.ArrayLike | None = None,
    *,
    columns: Sequence[str] | None = None,
) -> Cloud:
    """Registers points with a service that needs no preparation.

    It is the service at `GRAMIAN_URL`. Without this variable it is one on this machine. It is started at the
    first call, serves all threads, and ends with the interpreter, even if that is killed. A forked process
    starts a service of its own. `Client` has all options, and `local` starts a service for a block.

    Parameters
    ----------
    points : array_like, `[n, d]`, or str, os.PathLike or bytes
        A row of coordinates for each point, a PLY file, or a mesh or a cloud of trimesh, PyVista or Open3D, as for
        `Client.cloud`.
    normals : array_like, `[n, d]`, optional
        Normals of any length but 0, if known. Their side is the outward one.
    columns : sequence of str, optional
        Names of the coordinates, if `points` is a table, as for `Client.cloud`.

    Raises
    ------
    FileNotFoundError
        If there is no program to start. The message says where it was looked for, and how to get one.
    RuntimeError
        If the service ends before it listens. The message has what it logged.

    Examples
    --------
    >>> gramian.cloud([[0, 0], [1, 0], [0, 1]])
    Cloud(id='f70083fe…', n_points=3, dimension=2)
    """
    return shared_client().cloud(points, normals, columns=columns)
