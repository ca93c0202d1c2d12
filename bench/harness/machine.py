"""Facts that a table of times must state: machine, versions, date."""

import os
import subprocess
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from .lapack import openblas_core
from .setting import N_THREADS, Setting

PYTHON_PEERS = (
    "numpy",
    "scipy",
    "scikit-learn",
    "robust-laplacian",
    "open3d-cpu",
    "gpytorch",
    "torch",
    "orjson",
    "safetensors",
)
DEBIAN_PEERS = ("libcgal-dev", "libeigen3-dev", "wrk")
INSTRUCTION_SETS = ("avx2", "fma", "avx512f", "avx512vl", "avx512dq")


def describe(setting: Setting) -> list[tuple[str, str]]:
    """Starts a server and returns the facts as names and values, in the order of the report."""
    with setting.gramian() as server:
        return facts(setting, server.version())


def facts(setting: Setting, version: Mapping[str, str]) -> list[tuple[str, str]]:
    """Returns the facts as names and values. `version` is a server's answer to `/version`."""
    cpu = _cpu()
    flags = " ".join(name for name in INSTRUCTION_SETS if name in cpu.get("flags", "").split())
    return [
        ("date", datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")),
        ("CPU", f"{cpu.get('model name', 'unknown')}, {os.cpu_count()} cores, {N_THREADS} used; {flags}"),
        ("caches", _caches()),
        ("memory", f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.1f} GiB"),
        (
            "gramian",
            f"{version['version']}, commit {_commit(setting.root)}, kernel loops on {version['instruction_set']}",
        ),
        ("compiler", _output(["rustc", "--version"])),
        ("OpenBLAS", f"the one of SciPy's wheel, kernels for {openblas_core()}"),
        ("peers", ", ".join(_python_versions() + _debian_versions())),
    ]


def busy_cores(seconds: float = 3.0) -> float:
    """Returns the number of cores that other processes use, averaged over some seconds of sleep."""
    before = _cpu_ticks()
    time.sleep(seconds)
    idle, total = (after - first for after, first in zip(_cpu_ticks(), before, strict=True))
    return (os.cpu_count() or 1) * (1 - idle / total)


def _cpu_ticks() -> tuple[int, int]:
    """Returns idle ticks (including waits for a disk) and all ticks since the machine started."""
    ticks = [int(word) for word in Path("/proc/stat").read_text().splitlines()[0].split()[1:]]
    return ticks[3] + ticks[4], sum(ticks[:8])


def _cpu() -> dict[str, str]:
    first, _, _ = Path("/proc/cpuinfo").read_text().partition("\n\n")
    pairs = (line.partition(":") for line in first.splitlines())
    return {name.strip(): value.strip() for name, _, value in pairs}


def _caches() -> str:
    folders = sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*"))
    entries = [tuple((folder / name).read_text().strip() for name in ("level", "type", "size")) for folder in folders]
    return ", ".join(f"L{level} {kind.lower()} {size}" for level, kind, size in entries) or "unknown"


def _commit(root: Path) -> str:
    """Returns the commit of the sources. Files that the run itself writes do not count as changes."""
    commit = _output(["git", "-C", str(root), "rev-parse", "--short=10", "HEAD"])
    changed = _output(["git", "-C", str(root), "status", "--porcelain", "-uno", "--", ".", ":!bench"])
    return f"{commit} with changes" if changed else commit


def _python_versions() -> list[str]:
    found = []
    for name in PYTHON_PEERS:
        try:
            found.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            continue
    return found


def _debian_versions() -> list[str]:
    return [f"{name} {_output(['dpkg-query', '-W', '-f', '${Version}', name])}" for name in DEBIAN_PEERS]


def _output(command: list[str]) -> str:
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
