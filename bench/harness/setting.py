"""Locations of builds, and sizes and rounds of a run."""

import json
import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .lockstep import Child
from .server import Server

N_THREADS = 2


@dataclass(frozen=True)
class Setting:
    """The repository with its builds. A quick run tests the harness: small sizes, one round."""

    root: Path
    is_quick: bool
    with_gpytorch: bool
    benches: dict[str, Path] = field(default_factory=dict)

    @classmethod
    def of(cls, root: Path, is_quick: bool, with_gpytorch: bool) -> "Setting":
        return cls(root, is_quick, with_gpytorch, _bench_executables(root))

    def size(self, n: int, quick: int = 400) -> int:
        """Returns a problem size, limited to `quick` in a quick run."""
        return min(n, quick) if self.is_quick else n

    def rounds(self, n: int) -> int:
        return 1 if self.is_quick else n

    @property
    def environment(self) -> dict[str, str]:
        return {**os.environ, "RAYON_NUM_THREADS": str(N_THREADS), "GRAMIAN_THREADS": str(N_THREADS)}

    def gramian(self) -> Server:
        return Server(self._release / "gramian", ["--bind"], self.environment)

    def echo(self) -> Server:
        return Server(self._release / "examples" / "echo", [], self.environment)

    def bare(self, n_bytes: int) -> Server:
        """Starts a socket server that answers every request with n_bytes bytes."""
        return Server(self.python, ["-m", "harness.bare"], self.environment, more=[str(n_bytes)])

    def bench(self, name: str, *arguments: str) -> Child:
        """Starts a benchmark in lockstep."""
        return Child([str(self.benches[name]), *arguments, "--lockstep"], self.environment)

    def lapack(self, n: int, length_scale: float, alpha: float) -> Child:
        command = [str(self.python), "-m", "harness.lapack", str(n), str(length_scale), str(alpha)]
        return Child(command, self.environment)

    def output_of_bench(self, name: str, arguments: Sequence[str] = ()) -> str:
        """Runs a benchmark to its end and returns what it prints."""
        command = [str(self.benches[name]), *arguments]
        return subprocess.run(command, env=self.environment, check=True, capture_output=True, text=True).stdout

    @property
    def python(self) -> Path:
        return self.root / "bench" / ".venv" / "bin" / "python"

    @property
    def build(self) -> Path:
        return self.root / "bench" / ".build"

    @property
    def _release(self) -> Path:
        return Path(os.environ.get("CARGO_TARGET_DIR", self.root / "target")) / "release"


def _bench_executables(root: Path) -> dict[str, Path]:
    command = ["cargo", "bench", "--locked", "--no-run", "--bench", "*", "--message-format=json", "--quiet"]
    output = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    messages = [json.loads(line) for line in output.splitlines() if line.startswith("{")]
    artifacts = [message for message in messages if message["reason"] == "compiler-artifact" and message["executable"]]
    return {item["target"]["name"]: Path(item["executable"]) for item in artifacts if "bench" in item["target"]["kind"]}
