"""Who is shown how far a job is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ..rest.models import Job


class Progress(Protocol):
    """Is told how far a job is, until it is closed."""

    def __call__(self, job: Job) -> object:
        """Takes the job as it is now."""

    def close(self) -> object:
        """Says that there is no more to tell."""


class Bar:
    """A progress bar of tqdm, in a terminal or a notebook."""

    def __init__(self, name: str) -> None:
        """Names the computation.

        Raises
        ------
        ImportError
            Without tqdm: the extra `progress` of this package has it.
        """
        from tqdm.auto import tqdm

        layout = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}{postfix}"
        self._bar = tqdm(desc=name, total=1.0, bar_format=layout)

    def __call__(self, job: Job) -> None:
        """Moves on, and says what is being done."""
        progress = job.progress
        self._bar.n = max(self._bar.n, progress.fraction)
        parts = [progress.stage]
        if isinstance(progress.seconds_left, float):
            parts.append(f"{progress.seconds_left:.0f} s left")
        if isinstance(progress.residual, float):
            parts.append(f"residual {progress.residual:.0e}")
        self._bar.set_postfix_str(", ".join(parts))

    def close(self) -> None:
        """Leaves the bar as it is."""
        self._bar.close()


class Told:
    """A function that is told."""

    def __init__(self, function: Callable[[Job], object]) -> None:
        """Takes the function."""
        self._function = function

    def __call__(self, job: Job) -> None:
        """Tells it."""
        self._function(job)

    def close(self) -> None:
        """Has nothing to close."""
