#!/usr/bin/env python3
"""Checks that the README beside this program shows a tested source.

    sdk/readme.py FILE

The README must contain the file verbatim as a block of code: all of it or, if the file has the comments `begin README`
and `end README`, the lines between them without their indentation. At most ten lines may have code.
"""

import re
import sys
import textwrap
from pathlib import Path

MAX_LINES = 10


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    name = sys.argv[1]
    code = shown(Path(name).read_text())
    readme = Path(__file__).with_name("README.md").read_text()
    if f"\n{code}\n```\n" not in readme:
        sys.exit(f"sdk/README.md should contain this, from {name}:\n{code}")
    n_lines = sum(1 for line in code.splitlines() if line.strip())
    if n_lines > MAX_LINES:
        sys.exit(f"{name}: {n_lines} lines of code, and {MAX_LINES} should do")


def shown(source):
    """The part of a source that the README shows."""
    marked = re.search(r"[^\n]*begin README\n(.*?)[^\n]*end README", source, re.DOTALL)
    return textwrap.dedent(marked[1] if marked else source).strip()


if __name__ == "__main__":
    main()
