"""Services on this machine, by the program of the wheel, in an environment that is not activated."""

from __future__ import annotations

import importlib.metadata
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import psutil
import pytest

import gramian
from gramian.wire.tensors import Array

SECONDS = 60

NOTHING = {"PATH": ""}
"""An environment without any program on PATH, and without GRAMIAN_URL."""

BEGINNING = """
import os, sys, threading, gramian, psutil

points = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]

def services():
    return [child.pid for child in psutil.Process().children() if child.name() == "gramian"]
"""


def command(code: str) -> list[str]:
    return [sys.executable, "-I", "-W", "error::ResourceWarning", "-c", BEGINNING + textwrap.dedent(code)]


def run(code: str) -> str:
    """Runs a program of its own. Returns what it prints."""
    done = subprocess.run(command(code), env=NOTHING, capture_output=True, text=True, timeout=SECONDS)
    assert (done.returncode, "Warning" in done.stderr) == (0, False), done.stderr
    return done.stdout


def has_ended(pid: int) -> bool:
    try:
        return bool(psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)  # where nobody waits for orphans
    except psutil.NoSuchProcess:
        return True


def wait_for_end(pid: int) -> None:
    deadline = time.monotonic() + SECONDS
    while not has_ended(pid):
        assert time.monotonic() < deadline, f"process {pid} still runs"
        time.sleep(0.02)


def test_a_cloud_needs_no_server_and_leaves_none() -> None:
    printed = run("""
        curvatures = gramian.cloud(points).curvatures(kernel={"family": "gauss", "length_scale": 2})
        print(curvatures.mean_curvatures.round(1).tolist())
        gramian.cloud(points[:3])
        [service] = services()
        print(service)
    """)
    curvatures, service = printed.splitlines()
    assert curvatures == "[1.0, 1.0, 1.0, 1.0]"
    assert has_ended(int(service))


def test_the_service_ends_with_an_interpreter_that_is_killed_although_a_forked_child_lives() -> None:
    code = """
        gramian.cloud(points)
        [service] = services()
        if os.fork():
            print(service, flush=True)
        sys.stdin.read()
    """
    with subprocess.Popen(command(code), env=NOTHING, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as interpreter:
        assert interpreter.stdout
        service = int(interpreter.stdout.readline())
        [child] = [each for each in psutil.Process(interpreter.pid).children() if each.pid != service]
        assert not has_ended(service)
        interpreter.kill()
        wait_for_end(service)
        assert not has_ended(child.pid)


def test_threads_that_begin_at_once_share_one_service() -> None:
    run("""
        clouds = []
        barrier = threading.Barrier(8)
        def begin():
            barrier.wait()
            clouds.append(gramian.cloud(points))
        threads = [threading.Thread(target=begin) for _ in range(8)]
        for thread in threads: thread.start()
        for thread in threads: thread.join()
        assert len(clouds) == 8 and len(services()) == 1, services()
    """)


def test_a_forked_child_has_a_service_of_its_own_and_leaves_that_of_its_parent() -> None:
    run("""
        cloud = gramian.cloud(points)
        [service] = services()
        child = os.fork()
        if child == 0:
            assert services() == []
            gramian.cloud(points)
            [own] = services()
            assert own != service
            sys.exit()  # as a program ends, with all that is registered for it
        assert os.waitpid(child, 0)[1] == 0
        assert cloud.curvatures().mean_curvatures.shape == (4,)
        assert services() == [service]
    """)


def test_ctrl_c_ends_no_service() -> None:
    # What runs in the background of a script ignores interrupts, and so do its children.
    code = """
        import signal
        signal.signal(signal.SIGINT, signal.default_int_handler)
        cloud = gramian.cloud(points)
        try:
            print(*services(), flush=True)
            sys.stdin.read()
        except KeyboardInterrupt:
            print(len(cloud.curvatures().mean_curvatures), *services())
    """
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command(code), env=NOTHING, process_group=0, **pipes) as interpreter:  # type: ignore[call-overload]
        service = int(interpreter.stdout.readline())
        os.killpg(interpreter.pid, signal.SIGINT)
        assert interpreter.stdout.read().split() == [b"4", str(service).encode()]


def test_a_service_that_was_killed_is_replaced() -> None:
    run("""
        gramian.cloud(points)
        [service] = services()
        psutil.Process(service).kill()
        os.waitid(os.P_PID, service, os.WEXITED | os.WNOWAIT)
        gramian.cloud(points)
        [other] = services()
        assert other != service
    """)


def test_the_service_at_the_address_of_the_environment_is_preferred(circle: Array) -> None:
    before = psutil.Process().children()
    cloud = gramian.cloud(circle)
    assert str(cloud._connection.http.base_url) == os.environ["GRAMIAN_URL"]
    assert cloud._connection is gramian.cloud(circle)._connection
    assert psutil.Process().children() == before


def test_a_service_of_ones_own_ends_with_its_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GRAMIAN_BINARY", raising=False)
    with gramian.local() as client:
        assert client.version().version == importlib.metadata.version("gramian")
        assert client.cloud([[0, 0], [1, 0], [0, 1]]).n_points == 3
        [service] = [each for each in psutil.Process().children() if each.name() == "gramian"]
    assert has_ended(service.pid)
    with pytest.raises(RuntimeError, match="ended with status 0"), gramian.local("/bin/true"):
        pass


def test_the_environment_has_the_command(tmp_path: Path) -> None:
    rows = ["1 0 0", "-1 0 0", "0 1 0", "0 -1 0", "0 0 1", "0 0 -1"]
    properties = [f"property double {axis}" for axis in "xyz"]
    head = ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *properties, "end_header"]
    (tmp_path / "scan.ply").write_text("\n".join([*head, *rows, ""]))
    program = str(Path(sys.executable).with_name("gramian"))
    arguments = [program, "curvatures", "scan.ply", "-o", "out.ply"]
    assert subprocess.run(arguments, cwd=tmp_path, env=NOTHING, timeout=SECONDS).returncode == 0
    assert (tmp_path / "out.ply").read_bytes().startswith(b"ply\n")
