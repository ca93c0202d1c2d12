#!/usr/bin/env python3
"""Checks that the README of the clients shows a tested source.

    sdk/tools/readme.py FILE [PACKAGE]…

The README must contain the file verbatim as a block of code: all of it or, if the file has the comments `begin README`
and `end README`, the lines between them without their indentation. At most ten lines may have code. The README must also name the version
of each package that is installed from package.json.
"""

import json
import re
import sys
import textwrap
from pathlib import Path

MAX_LINES = 10
TOOLS = Path(__file__).parent


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    name, packages = sys.argv[1], sys.argv[2:]
    code = shown(Path(name).read_text())
    readme = (TOOLS.parent / "README.md").read_text()
    if f"\n{code}\n```\n" not in readme:
        sys.exit(f"sdk/README.md should contain this, from {name}:\n{code}")
    n_lines = sum(1 for line in code.splitlines() if line.strip())
    if n_lines > MAX_LINES:
        sys.exit(f"{name}: {n_lines} lines of code, and {MAX_LINES} should do")
    versions = json.loads((TOOLS / "package.json").read_text())["devDependencies"]
    for package in packages:
        if not re.search(rf"(?<!\S){re.escape(package)}@{re.escape(versions[package])}(?!\S)", readme):
            sys.exit(f"sdk/README.md should name {package}@{versions[package]}")


def shown(source):
    """The part of a source that the README shows."""
    marked = re.search(r"[^\n]*begin README\n(.*?)[^\n]*end README", source, re.DOTALL)
    return textwrap.dedent(marked[1] if marked else source).strip()


if __name__ == "__main__":
    main()
