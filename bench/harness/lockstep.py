"""Child processes that run one round on request, so that ours and the reference take turns."""

import subprocess
from collections.abc import Mapping, Sequence
from types import TracebackType


class Child:
    """A child process that runs one round per line on standard input.

    It answers each line with lines `name<TAB>figure<TAB>unit` and an empty line.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        self._process = subprocess.Popen(
            command, env=dict(environment), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )

    def ask(self, line: str = "") -> dict[str, float]:
        """Asks the process for one round, and waits for its figures."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        figures = {}
        while answer := self._process.stdout.readline():
            if answer == "\n":
                return figures
            name, figure, _unit = answer.rstrip("\n").split("\t")
            figures[name] = float(figure)
        raise RuntimeError(f"{self._process.args!r} ended early")

    def __enter__(self) -> "Child":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(timeout=60)
        except subprocess.TimeoutExpired:
            self._process.kill()
