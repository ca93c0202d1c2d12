"""A service for a block: `with gramian.local() as client: …`."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any

from ..client import Client
from .process import LocalService
from .program import find_program


@contextlib.contextmanager
def local(binary: str | os.PathLike[str] | None = None, **options: Any) -> Iterator[Client]:  # noqa: ANN401 (those of Client)
    """Starts a service on a free port of this machine, and ends it with the block or the interpreter.

    Parameters
    ----------
    binary : path, optional
        The program. If absent, `GRAMIAN_BINARY`, or else the one that came with this package, or `gramian` on
        `PATH`. The environment of this interpreter need not be activated.
    **options
        Options of the client, as of `gramian.Client`.

    Yields
    ------
    Client
        A client of the service.

    Raises
    ------
    FileNotFoundError
        If there is no program. The message says where it was looked for, and how to get one.
    RuntimeError
        If the service ends before it listens. The message has what it logged.

    Examples
    --------
    >>> with gramian.local() as client:
    ...     client.version().name
    'gramian'
    """
    service = LocalService(find_program(binary))
    try:
        with Client(service.url, **options) as client:
            yield client
    finally:
        service.stop()
