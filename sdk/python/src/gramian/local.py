"""A service of one's own for a while: `with gramian.local() as client: …`."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from .client import Client

SECONDS_TO_START = 30
SECONDS_TO_STOP = 20


@contextlib.contextmanager
def local(binary: str | os.PathLike[str] | None = None, **options: Any) -> Iterator[Client]:  # noqa: ANN401 (those of Client)
    """Starts a service on a free port of this machine, and ends it with the block.

    Parameters
    ----------
    binary : path, optional
        The program. If absent, `GRAMIAN_BINARY`, or else `gramian` beside this package or on `PATH`.
    **options
        Options of the client, as of `gramian.Client`.

    Yields
    ------
    Client
        A client of the service.

    Raises
    ------
    FileNotFoundError
        If there is no program.
    RuntimeError
        If the service ends before it listens. The message has what it said.

    Examples
    --------
    >>> with gramian.local() as client:
    ...     client.version().name
    'gramian'
    """
    program = found(binary)
    # Settings of another service, such as its keys, are none of this one.
    variables = {name: value for name, value in os.environ.items() if not name.startswith("GRAMIAN_")}
    with tempfile.TemporaryFile() as log:
        command = [str(program), "--bind", "127.0.0.1:0"]
        process = subprocess.Popen(command, env=variables | {"RUST_LOG": "info"}, stderr=log, stdout=subprocess.DEVNULL)  # noqa: S603
        try:
            with Client(f"http://{address_of(process, log)}", **options) as client:
                yield client
        finally:
            stop(process)


def found(binary: str | os.PathLike[str] | None) -> Path:
    """Finds the program."""
    given = binary or os.environ.get("GRAMIAN_BINARY")
    places = [given] if given else [Path(__file__).with_name("gramian"), shutil.which("gramian")]
    for place in places:
        if place is not None and Path(place).is_file():
            return Path(place)
    message = f"there is no program {given}" if given else "gramian is neither beside this package nor on PATH"
    raise FileNotFoundError(f"{message}; build it by cargo build --release, and set GRAMIAN_BINARY to its path")


def address_of(process: subprocess.Popen[bytes], log: IO[bytes]) -> str:
    """Returns the address that the service says it listens at."""
    deadline = time.monotonic() + SECONDS_TO_START
    while time.monotonic() < deadline:
        # The program writes at the place of the file that both share, so it is not moved.
        written = os.pread(log.fileno(), os.fstat(log.fileno()).st_size, 0)
        lines = written.decode(errors="replace").splitlines(keepends=True)
        for line in lines:
            if line.endswith("\n") and '"address"' in line:
                address: str = json.loads(line)["fields"]["address"]
                return address
        if process.poll() is not None:
            raise RuntimeError(f"gramian ended with status {process.returncode}: {''.join(lines)}")
        time.sleep(0.05)
    raise RuntimeError(f"gramian does not listen after {SECONDS_TO_START} s")


def stop(process: subprocess.Popen[bytes]) -> None:
    """Ends the service, after the requests under way."""
    process.terminate()
    try:
        process.wait(SECONDS_TO_STOP)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
