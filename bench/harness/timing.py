"""Times of tasks that take turns."""

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Times:
    """Seconds of one task, a number per round."""

    seconds: tuple[float, ...]

    @property
    def best(self) -> float:
        return min(self.seconds)

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)

    def __add__(self, other: "Times") -> "Times":
        return Times(tuple(a + b for a, b in zip(self.seconds, other.seconds, strict=True)))


#: Threads of a numerical library spin for a while after a call; whoever is measured next must not pay for it.
SPIN_SECONDS = 0.1


def alternate(n_rounds: int, tasks: Mapping[str, Callable[[int], float]], pause: float = 0.0) -> dict[str, Times]:
    """Runs all tasks once per round, in turn, so that a drifting machine disturbs all of them.

    A task gets the number of the round and answers with the seconds that count. Round 0 warms up and is forgotten. Before
    each task there is a pause, in seconds.
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
    """The candidate with the best time, with its name."""
    return min(candidates.items(), key=lambda candidate: candidate[1].best)


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """What a piece of work answers, and the seconds it took."""
    began = time.perf_counter()
    result = work()
    return result, time.perf_counter() - began
