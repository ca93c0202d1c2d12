#!/usr/bin/env python3
"""Runs a command against a fresh server.

    tests/with_server.py GRAMIAN COMMAND [ARGUMENT]…

Starts the binary GRAMIAN on a free port, in its default configuration, and runs the command. The command gets
the base URL of the server as GRAMIAN_URL, and the path of the binary as GRAMIAN_BINARY, in case it starts
more servers. Then ends the server and exits with the status of the command. Neither sees other GRAMIAN_
variables. Needs only the standard library.
"""

import contextlib
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SECONDS_TO_START = 20
SECONDS_TO_STOP = 20


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    with server(sys.argv[1]) as (base, _):
        variables = {"GRAMIAN_URL": base, "GRAMIAN_BINARY": str(Path(sys.argv[1]).resolve())}
        outcome = subprocess.run(sys.argv[2:], env=environment() | variables, check=False)
    sys.exit(outcome.returncode)


@contextlib.contextmanager
def server(binary, flags=()):
    """Runs a server on a free port, with `flags` and otherwise its default configuration.

    Yields its base URL and process id.
    """
    with tempfile.TemporaryFile() as log:
        command = [str(Path(binary).resolve()), "--bind", "127.0.0.1:0", *flags]
        process = subprocess.Popen(command, env=environment() | {"RUST_LOG": "info"}, stderr=log)
        try:
            yield f"http://{address_of(process, log)}", process.pid
        finally:
            stop(process)


def environment():
    """Returns the variables of this program, except those that configure gramian or its clients."""
    return {name: value for name, value in os.environ.items() if not name.startswith("GRAMIAN_")}


def stop(process):
    """Ends the server. Waits for the requests under way, for at most SECONDS_TO_STOP."""
    process.terminate()
    try:
        process.wait(SECONDS_TO_STOP)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def address_of(process, log):
    """Returns the address that the server logs when it listens."""
    for _ in range(10 * SECONDS_TO_START):
        log.seek(0)
        text = log.read().decode(errors="replace")
        found = re.search(r'"address":"([^"]+)"', text)
        if found:
            return found[1]
        if process.poll() is not None:
            sys.exit(f"the server ended with status {process.returncode}: {text}")
        time.sleep(0.1)
    sys.exit(f"the server does not listen after {SECONDS_TO_START} s")


if __name__ == "__main__":
    main()
