"""Where the program is looked for, in layouts as installers make them."""

from __future__ import annotations

import sys
import sysconfig
from pathlib import Path

import pytest

from gramian.service import program
from gramian.service.program import find_program, kind_of_installation

LAYOUTS = {
    "beside the package in an environment": ("venv/lib/python3.13/site-packages/gramian", "venv/bin"),
    "in a prefix of Debian": ("usr/lib/python3/dist-packages/gramian", "usr/bin"),
    "in a folder of pip install --target": ("target/gramian", "target/bin"),
    "with the scripts of the interpreter": ("sources/gramian", "scripts"),
    "with the scripts of the interpreter that an environment was made from": ("sources/gramian", "base"),
    "with the scripts of the user": ("sources/gramian", "user"),
    "on PATH": ("sources/gramian", "path"),
}


@pytest.fixture(autouse=True)
def _only_made_up_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def get_path(name: str, scheme: str = "", vars: dict[str, str] | None = None) -> str:  # noqa: A002
        assert name == "scripts"
        if vars:
            assert vars == {"base": sys.base_prefix}
            return str(tmp_path / "base")
        return str(tmp_path / ("user" if scheme else "scripts"))

    monkeypatch.setattr(sysconfig, "get_path", get_path)
    monkeypatch.setattr(program, "PACKAGE", tmp_path / "sources/gramian")
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    monkeypatch.delenv("GRAMIAN_BINARY", raising=False)


def made(path: Path, mode: int = 0o755) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(mode)
    return path


@pytest.mark.parametrize(("package", "folder"), LAYOUTS.values(), ids=LAYOUTS)
def test_the_program_is_found(package: str, folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PACKAGE", tmp_path / package)
    with pytest.raises(FileNotFoundError):
        find_program()
    expected = made(tmp_path / folder / "gramian", 0o644)
    with pytest.raises(FileNotFoundError):  # nobody may execute it
        find_program()
    expected.chmod(0o755)
    assert find_program() == expected


def test_a_clone_uses_what_cargo_has_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PACKAGE", tmp_path / "clone/sdk/python/src/gramian")
    made(tmp_path / "path/gramian")
    expected = made(tmp_path / "clone/target/release/gramian")
    assert find_program() == tmp_path / "path/gramian"  # not a clone yet
    (tmp_path / "clone/Cargo.toml").touch()
    assert find_program() == expected


def test_the_program_of_the_same_installation_is_preferred(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package, folder = LAYOUTS["beside the package in an environment"]
    monkeypatch.setattr(program, "PACKAGE", tmp_path / package)
    expected = made(tmp_path / folder / "gramian")
    for other in ("scripts", "base", "user", "path"):
        made(tmp_path / other / "gramian")
    assert find_program() == expected


def test_a_program_that_is_named_is_the_only_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made(tmp_path / "scripts/gramian")
    named, given = made(tmp_path / "named"), made(tmp_path / "given")
    monkeypatch.setenv("GRAMIAN_BINARY", str(named))
    assert find_program() == named
    assert find_program(given) == given
    for missing in ("/nowhere/gramian", None):
        with pytest.raises(FileNotFoundError, match="no program /nowhere/gramian"):
            find_program(missing)
        monkeypatch.setenv("GRAMIAN_BINARY", "/nowhere/gramian")


def test_the_error_has_all_places_and_ways_on(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as error:
        find_program()
    message = str(error.value)
    for folder in ("sources/bin", "scripts", "base", "user"):
        assert f" - {tmp_path / folder}\n" in message
    assert "on PATH" in message
    for way in ("pip install", "cargo build --release", "GRAMIAN_BINARY", "gramian.Client(url)", "GRAMIAN_URL"):
        assert way in message


@pytest.mark.parametrize(
    ("wheel", "expected"),
    [
        ("Root-Is-Purelib: true\nTag: py3-none-any\n", "This is the pure wheel"),
        ("Root-Is-Purelib: false\nTag: py3-none-manylinux_2_28_x86_64\n", "came with the program, which is gone"),
        (None, "not installed from a wheel"),
    ],
)
def test_the_error_says_what_is_installed(
    wheel: str | None, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "venv/lib/python3.13/site-packages/gramian"
    information = package.parent / "gramian-1.2.3.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text("Metadata-Version: 2.4\nName: gramian\nVersion: 1.2.3\n")
    if wheel:
        (information / "WHEEL").write_text(f"Wheel-Version: 1.0\n{wheel}")
    assert expected in kind_of_installation(package)
    monkeypatch.setattr(program, "PACKAGE", package)
    with pytest.raises(FileNotFoundError, match=expected):
        find_program()


def test_sources_are_told_from_an_installation_elsewhere(tmp_path: Path) -> None:
    assert kind_of_installation(tmp_path / "sources/gramian") == "This package was not installed from a wheel."
