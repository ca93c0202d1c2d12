"""The servers that answer tiles, each of which can answer any of them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeVar

import httpx

from ..client import Client
from ..problems import Overloaded, Problem

T = TypeVar("T")

ROUNDS = 4
"""How often all replicas are asked before a task gives up; Dask's own retries come on top."""

PAUSE_SECONDS = 1.0
"""The wait after the first round; doubled from one to the next."""

DEADLINE_EXCEEDED = 504
"""What would take as long anywhere else."""


@dataclass(frozen=True)
class Replicas:
    """Addresses of servers, as tasks carry them: clients are made by each process that asks.

    Attributes
    ----------
    urls
        Addresses, as for `gramian.Client`.
    api_key
        One for all; None if they want none.
    timeout
        Seconds to wait for each next part of an answer.
    """

    urls: tuple[str, ...]
    api_key: str | None = field(default=None, repr=False)
    timeout: float = 300.0

    def ask(self, first: int, call: Callable[[Client], T]) -> T:
        """Returns what `call` makes of a replica: of number `first`, or of those after it where one does not answer.

        `call` may be begun several times, so it is to be made of operations that may be repeated, as all of the
        service are.

        Parameters
        ----------
        first : int
            Any number that spreads what is asked over the replicas, such as that of a tile.
        call : callable
            Takes a `gramian.Client`.

        Raises
        ------
        Problem
            If a replica refuses the request, or, after all rounds, if the last one is overloaded or broken.
        httpx.TransportError
            If none answers after all rounds.
        """
        attempts = ROUNDS * len(self.urls)
        for attempt in range(attempts):
            url = self.urls[(first + attempt) % len(self.urls)]
            try:
                return call(_client(url, self.api_key, self.timeout, os.getpid()))
            except (Problem, httpx.TransportError) as error:
                if attempt + 1 == attempts or not _may_work_elsewhere(error):
                    raise
            if (attempt + 1) % len(self.urls) == 0:
                time.sleep(PAUSE_SECONDS * 2 ** (attempt // len(self.urls)))
        raise AssertionError("a replica answers or raises")


def _may_work_elsewhere(error: Problem | httpx.TransportError) -> bool:
    if isinstance(error, Problem):
        return isinstance(error, Overloaded) or (error.status >= 500 and error.status != DEADLINE_EXCEEDED)
    return True


@lru_cache(maxsize=64)
def _client(url: str, api_key: str | None, timeout: float, process: int) -> Client:  # noqa: ARG001 (a key of the cache)
    """Returns the client of a replica, one for all threads of a process."""
    return Client(url, api_key=api_key, timeout=timeout, retries=1)
