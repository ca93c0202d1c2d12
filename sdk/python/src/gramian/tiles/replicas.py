"""The servers that answer tiles, each of which can answer any of them."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeVar

import httpx

from ..client import Client
from ..wire.problems import Overloaded, Problem

T = TypeVar("T")

ROUNDS = 4
"""How often all replicas are tried before a task gives up; Dask's own retries come on top."""

PAUSE_SECONDS = 1.0
"""The wait after the first round; doubled from one to the next. Longer where replicas ask for more."""

MAX_PAUSE_SECONDS = 60.0
"""What they may ask for."""

CONNECT_SECONDS = 10.0
"""The wait for a connection: a machine that is lost does not answer."""

SILENT_SECONDS = 30.0
"""How long a replica that did not answer is tried after all others, by this process."""

DEADLINE_EXCEEDED = 504
"""What would take as long anywhere else."""


@dataclass(frozen=True)
class Replicas:
    """Addresses of servers, as tasks carry them: clients are made by each process that asks."""

    urls: tuple[str, ...]
    api_key: str | None = field(default=None, repr=False)  # of all; if None, that of each process's environment
    timeout: float = 300.0  # seconds to wait for each next part of an answer

    def ask(self, first: int, call: Callable[[Client], T]) -> T:
        """Returns what `call` makes of a replica: of number `first`, or of those after it where one does not answer.

        `call` may be started several times, so all its operations must be safe to repeat, as those of the service are.

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
        for round_ in range(ROUNDS):
            waits = [PAUSE_SECONDS * 2**round_]
            for at, url in enumerate(urls := self._in_turn(first)):
                try:
                    answer = call(_client(url, self.api_key, self.timeout, os.getpid()))
                except (Problem, httpx.TransportError) as error:
                    is_last = (round_, at) == (ROUNDS - 1, len(urls) - 1)
                    if is_last or not _may_work_elsewhere(error):
                        raise
                    waits.append(_noted(url, error))
                else:
                    _silent.pop(url, None)
                    return answer
            time.sleep(max(waits))
        raise AssertionError("a replica answers or raises")

    def _in_turn(self, first: int) -> list[str]:
        """Returns the addresses from number `first` on, those that did not answer lately after all others."""
        start, now = first % len(self.urls), time.monotonic()
        urls = self.urls[start:] + self.urls[:start]
        return sorted(urls, key=lambda url: _silent.get(url, now) > now)


_silent: dict[str, float] = {}
"""Addresses that did not answer, with the time until which they are tried last. Of this process."""


def _noted(url: str, error: Problem | httpx.TransportError) -> float:
    """Remembers who is silent; returns the seconds that the others ask for."""
    if isinstance(error, Problem):
        return min(error.retry_after or 0.0, MAX_PAUSE_SECONDS)
    _silent[url] = time.monotonic() + SILENT_SECONDS
    return 0.0


def _may_work_elsewhere(error: Problem | httpx.TransportError) -> bool:
    if isinstance(error, Problem):
        return isinstance(error, Overloaded) or (error.status >= 500 and error.status != DEADLINE_EXCEEDED)
    return True


@lru_cache(maxsize=64)
def _client(url: str, api_key: str | None, timeout: float, process: int) -> Client:  # noqa: ARG001 (a key of the cache)
    """Returns the client of a replica, one for all threads of a process. `ask` tries again, elsewhere."""
    seconds = None if timeout == math.inf else timeout
    bounds = httpx.Timeout(seconds, connect=min(timeout, CONNECT_SECONDS))
    return Client(url, api_key=api_key, timeout=bounds, retries=0)
