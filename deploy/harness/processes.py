"""Child processes with separate ports, in a temporary directory. All end with this process."""

import contextlib
import os
import signal
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

SECONDS_TO_START = 30
SECONDS_TO_END = 40
# The kernel ends the children if this process is killed and cannot end them itself.
WITH_PARENT = ["setpriv", "--pdeathsig", "KILL"]


class Failed(Exception):
    """Raised when something does not work at all, so that the rest of the run has no meaning."""


def free_port():
    """Returns a port that no process listens on. Ports of a run differ."""
    while True:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        if port not in _given:
            _given.add(port)
            return port


_given = set()


class Processes:
    """The processes of a run, by name, with their logs."""

    def __init__(self):
        self.directory = Path(tempfile.mkdtemp(prefix="gramian-deploy-"))
        # The workers of nginx run as another user.
        self.directory.chmod(0o711)
        self._running = {}

    def start(self, name, command, variables=(), ready=None):
        """Starts a command and waits for 200 at the address `ready`."""
        environment = {key: value for key, value in os.environ.items() if not key.startswith(("GRAMIAN_", "AWS_"))}
        with self.log(name).open("ab") as log:
            process = subprocess.Popen(
                [*WITH_PARENT, *map(str, command)],
                env={**environment, **dict(variables)},
                cwd=self.directory,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                process_group=0,  # Ctrl-C reaches only this program, which ends the others in order
            )
        self._running[name] = process
        if ready:
            self._wait(name, process, ready)

    def _wait(self, name, process, address):
        until = time.monotonic() + SECONDS_TO_START
        while not answers(address):
            if process.poll() is not None:
                raise Failed(f"{name} ended with status {process.returncode}")
            if time.monotonic() > until:
                raise Failed(f"{name} does not answer at {address}")
            time.sleep(0.05)

    def end(self, name, how=signal.SIGTERM):
        """Ends a process, waits for it, and returns its status."""
        process = self._running.pop(name)
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(how)
        try:
            return process.wait(SECONDS_TO_END)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    @contextlib.contextmanager
    def halted(self, name):
        """Stops a process until the block ends. It still accepts connections, but does not answer."""
        process = self._running[name]
        process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            process.send_signal(signal.SIGCONT)

    def end_all(self):
        """Kills all running processes and their workers."""
        for process in self._running.values():
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        for process in self._running.values():
            process.wait()
        self._running.clear()

    def log(self, name):
        """Returns the log file of a process."""
        return self.directory / f"{name}.log"

    def last_words(self):
        """Yields the last lines of all logs."""
        for path in sorted(self.directory.glob("*.log")):
            lines = path.read_text(errors="replace").splitlines()[-4:]
            yield f"--- {path.name}"
            yield from (line[:200] for line in lines)


def get(address, timeout=5.0):
    """Returns the body at an address."""
    with urllib.request.urlopen(address, timeout=timeout) as response:
        return response.read()


def answers(address):
    """Returns true if the address answers with success."""
    try:
        get(address, timeout=1.0)
    except (OSError, urllib.error.URLError):
        return False
    return True


def put(address):
    """Sends a PUT without a body."""
    urllib.request.urlopen(urllib.request.Request(address, method="PUT"), timeout=10).close()


def post(address):
    """Sends a POST without a body."""
    urllib.request.urlopen(urllib.request.Request(address, method="POST"), timeout=10).close()
