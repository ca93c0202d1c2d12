"""Displays of the progress of a job."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ..rest.models import Job


class Progress(Protocol):
    """A display of the progress of a job."""

    def __call__(self, job: Job) -> object:
        """Shows the current state of the job."""

    def close(self) -> object:
        """Ends the display."""


class Bar:
    """A progress bar of tqdm, in a terminal or a notebook."""

    def __init__(self, name: str) -> None:
        """Names the computation.

        Raises
        ------
        ImportError
            If tqdm is not installed. The extra `progress` of this package installs it.
        """
        from tqdm.auto import tqdm

        layout = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}{postfix}"
        self._bar = tqdm(desc=name, total=1.0, bar_format=layout)

    def __call__(self, job: Job) -> None:
        """Advances the bar, and shows the current stage."""
        progress = job.progress
        self._bar.n = max(self._bar.n, progress.fraction)
        parts = [progress.stage]
        if isinstance(progress.seconds_left, float):
            parts.append(f"{progress.seconds_left:.0f} s left")
        if isinstance(progress.residual, float):
            parts.append(f"residual {progress.residual:.0e}")
        self._bar.set_postfix_str(", ".join(parts))

    def close(self) -> None:
        """Ends the bar, and leaves it visible."""
        self._bar.close()


class Told:
    """A display that passes each state of the job to a function."""

    def __init__(self, function: Callable[[Job], object]) -> None:
        """Takes the function."""
        self._function = function

    def __call__(self, job: Job) -> None:
        """Calls the function with the current state of the job."""
        self._function(job)

    def close(self) -> None:
        """Does nothing."""
