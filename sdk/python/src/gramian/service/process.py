"""A service as a process of this machine, which ends with this interpreter."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path
from typing import IO

SECONDS_TO_START = 30
SECONDS_TO_STOP = 20

LEVELS = "warn,gramian=info,gramian::http=warn"
"""Levels of the log: that the service listens, and what goes wrong, but no line for each request."""


class LocalService:
    """A service on a free port of this machine.

    Its standard input is a pipe whose other end this interpreter holds. The service ends when that is closed,
    so it never outlives the interpreter, not even one that is killed.

    Parameters
    ----------
    program : Path
        The program.

    Raises
    ------
    RuntimeError
        If the service ends before it listens. The message has what it logged.
    """

    def __init__(self, program: Path) -> None:
        """Starts the service, and waits until it listens."""
        # GRAMIAN_* settings are not inherited: they configure other services, with keys for example.
        variables = {name: value for name, value in os.environ.items() if not name.startswith("GRAMIAN_")}
        with tempfile.TemporaryFile() as log:
            self._process = subprocess.Popen(  # noqa: S603
                [str(program), "--bind", "127.0.0.1:0", "--while-stdin"],
                env=variables | {"RUST_LOG": LEVELS},
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=log,
                # A terminal sends Ctrl-C to the whole group of its foreground. The service must survive that.
                process_group=0,
            )
            try:
                self.url = f"http://{address_of(self._process, log)}"
            except BaseException:
                self.stop()
                raise

    def is_running(self) -> bool:
        """Returns whether the process has not ended."""
        return self._process.poll() is None

    def stop(self) -> None:
        """Ends the service, after the requests under way."""
        self._close_stdin()
        try:
            self._process.wait(SECONDS_TO_STOP)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def leave(self) -> None:
        """Leaves the service to the process that started it. To be called in a child after a fork."""
        self._close_stdin()  # the copy of the child, which would let the service outlive its owner
        self._process.poll()  # the service is no child of this process: nothing is left to be waited for

    def _close_stdin(self) -> None:
        if self._process.stdin:
            with contextlib.suppress(OSError):
                self._process.stdin.close()


def address_of(process: subprocess.Popen[bytes], log: IO[bytes]) -> str:
    """Returns the address that the service says it listens at."""
    deadline = time.monotonic() + SECONDS_TO_START
    while time.monotonic() < deadline:
        # The program writes at the offset of the file, which both share. So this must not move it.
        written = os.pread(log.fileno(), os.fstat(log.fileno()).st_size, 0)
        lines = written.decode(errors="replace").splitlines(keepends=True)
        for line in lines:
            if line.endswith("\n") and '"address"' in line:
                address: str = json.loads(line)["fields"]["address"]
                return address
        if process.poll() is not None:
            raise RuntimeError(f"gramian ended with status {process.returncode}: {''.join(lines)}")
        time.sleep(0.02)
    raise RuntimeError(f"gramian does not listen after {SECONDS_TO_START} s")
