"""Timing of tasks that take turns."""

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Times:
    """Seconds of one task, one number per round."""

    seconds: tuple[float, ...]

    @property
    def best(self) -> float:
        return min(self.seconds)

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)

    def __add__(self, other: "Times") -> "Times":
        return Times(tuple(a + b for a, b in zip(self.seconds, other.seconds, strict=True)))


#: Pause in seconds. Threads of a numerical library spin for a while after a call and would slow the next
#: task.
SPIN_SECONDS = 0.1


def alternate(n_rounds: int, tasks: Mapping[str, Callable[[int], float]], pause: float = 0.0) -> dict[str, Times]:
    """Runs all tasks once per round, in turn, so that a drifting machine disturbs all of them.

    A task takes the number of the round and returns the seconds that count. Round 0 warms up and is
    discarded. `pause` seconds pass before each task.
    """
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    for round_number in range(n_rounds + 1):
        for name, task in tasks.items():
            time.sleep(pause)
            spent = task(round_number)
            if round_number > 0:
                seconds[name].append(spent)
    return {name: Times(tuple(spent)) for name, spent in seconds.items()}


def fastest(candidates: Mapping[str, Times]) -> tuple[str, Times]:
    """Returns the candidate with the best time, and its name."""
    return min(candidates.items(), key=lambda candidate: candidate[1].best)


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """Runs a piece of work; returns its result and the seconds it took."""
    began = time.perf_counter()
    result = work()
    return result, time.perf_counter() - began
