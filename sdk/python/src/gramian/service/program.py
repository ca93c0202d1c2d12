"""Where the program `gramian` is. Wheels bring it, and so do cargo and package managers."""

from __future__ import annotations

import os
import shutil
import sys
import sysconfig
from importlib.metadata import Distribution
from pathlib import Path

NAME = "gramian"

PACKAGE = Path(__file__).absolute().parents[1]
"""The folder of this package, in which installers leave it."""


def find_program(binary: str | os.PathLike[str] | None = None) -> Path:
    """Returns the path of the program.

    Parameters
    ----------
    binary : path, optional
        The program. If absent, `GRAMIAN_BINARY`, or else `gramian` in one of `script_folders` or on `PATH`.

    Raises
    ------
    FileNotFoundError
        If there is no program. The message has all places, and says how to get one.
    """
    given = binary or os.environ.get("GRAMIAN_BINARY")
    if given:
        if Path(given).is_file():
            return Path(given)
        raise FileNotFoundError(f"there is no program {given}, which binary or GRAMIAN_BINARY names. {WAYS_ON}")
    folders = script_folders(PACKAGE)
    for folders_of_path in [*map(str, folders), None]:  # None is PATH
        program = shutil.which(NAME, path=folders_of_path)
        if program:
            return Path(program)
    places = "\n".join(f" - {folder}" for folder in folders)
    raise FileNotFoundError(
        f"the program {NAME} is neither on PATH nor in\n{places}\n{kind_of_installation(PACKAGE)} {WAYS_ON}"
    )


def script_folders(package: Path) -> list[Path]:
    """Returns the folders into which installers put the program, given the folder of this package.

    None of them needs to be on `PATH`, so an environment need not be activated. The first ones belong to the
    installation of this package, whose program has its version.
    """
    site_packages = package.parent
    folders = [site_packages / "bin"]  # pip install --target
    if site_packages.name in ("site-packages", "dist-packages"):
        folders.insert(0, package.parents[3] / "bin")  # <prefix>/lib/python3.13/site-packages/gramian
    folders += [
        Path(sysconfig.get_path("scripts")),
        Path(sysconfig.get_path("scripts", vars={"base": sys.base_prefix})),
        Path(sysconfig.get_path("scripts", scheme=sysconfig.get_preferred_scheme("user"))),
    ]
    clone = package.parents[3]
    if (clone / "Cargo.toml").is_file():  # the package of a clone, as it stands: what cargo has built there
        folders = [clone / "target/release", clone / "target/debug", *folders]
    return list(dict.fromkeys(folders))


def kind_of_installation(package: Path) -> str:
    """Says in a sentence which wheel has installed the package, and thus why there may be no program."""
    found = next(iter(Distribution.discover(name=NAME, path=[str(package.parent)])), None)
    wheel = (found and found.read_text("WHEEL")) or ""
    if "Root-Is-Purelib: true" in wheel:
        return (
            "This is the pure wheel (py3-none-any), which has the client alone. Installers choose it where no wheel "
            "with the program fits: on Windows, or with an older C library."
        )
    if wheel:
        return "This wheel came with the program, which is gone."
    return "This package was not installed from a wheel."


WAYS_ON = (
    f"On Linux and macOS install the wheel with the program: pip install --force-reinstall {NAME}. Or build the "
    "program (cargo build --release): the package of that clone finds it, and others by its path in GRAMIAN_BINARY. Or "
    "use a service elsewhere, by gramian.Client(url) or GRAMIAN_URL."
)
