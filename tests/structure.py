#!/usr/bin/env python3
"""Holds the sources to the shape that ARCHITECTURE.md promises, and names every place that departs from it.

- No circles: what stands side by side in a folder, files and whole folders, knows one another in one
  direction only. The front of a folder (mod.rs, lib.rs, __init__.py) speaks for all that it holds, so what it
  holds may know it.
- At most 12 doors a folder: what stands in it beside its own front (mod.rs, lib.rs, __init__.py) and tests.
- No function of Rust longer than 80 lines.
- No comment wider than 110 columns, no Markdown wider than 140 (widths.py).

Reads imports as text, which suffices for code that rustfmt has laid out. Tests, generated code and the
clients in other languages are left out of the first three rules. Needs nothing but the standard library.

`--count` prints the lines of code of each part instead: neither empty nor comments alone, generated code left
out.
"""

import ast
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

from widths import wide_lines

ROOT = Path(__file__).resolve().parent.parent
CRATES = {
    "gramian": ROOT / "src",
    "gramian_host": ROOT / "host/src",
    "gramian_numerics": ROOT / "numerics/src",
    "gramian_observer": ROOT / "observer/src",
}
PACKAGE = ROOT / "sdk/python/src/gramian"
MAX_DOORS = 12
MAX_FUNCTION_LINES = 80
FRONTS = {"mod.rs", "lib.rs", "main.rs", "__init__.py", "py.typed"}
TEST = re.compile(r"(^|/)(tests|interleavings|testing)(/|\.rs$)|_tests\.rs$")


# Parts of paths that nobody wrote by hand: generated, vendored, data.
NOT_WRITTEN = re.compile(r"/rest/|/vendor/|^fuzz/corpus/|^tests/(clouds|tables)/")


def main():
    """Prints what departs from the rules, and fails if anything does."""
    if sys.argv[1:] == ["--count"]:
        return print("\n".join(f"{n:7,} {part}" for part, n in code_lines().items()))
    arrows = all_arrows()
    rules = [circles(arrows), crowded_folders(), long_functions(), wide_texts()]
    found = [complaint for complaints in rules for complaint in complaints]
    print("\n".join(found) or f"{len(arrows)} modules and {len(written())} files: no departure from the rules")
    sys.exit(bool(found))


def name(path):
    """A path as people say it."""
    return str(path.relative_to(ROOT))


def written(suffix=""):
    """Files under version control that people wrote."""
    command = ["git", "ls-files", "-z", f"*{suffix}"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return [ROOT / path for path in listed.stdout.split("\0") if path and not NOT_WRITTEN.search(path)]


def code_lines():
    """Numbers of lines of Rust, Python and JavaScript in each part of the tree, and in all."""
    counts = Counter()
    for path in (path for suffix in (".rs", ".py", ".js") for path in written(suffix)):
        parts = path.relative_to(ROOT).parts
        part = "/".join(parts[: 2 if parts[0] in {"host", "numerics", "sdk"} else 1]) if len(parts) > 1 else "."
        lines = [] if path.is_symlink() else map(str.strip, path.read_text().splitlines())
        counts[part] += sum(not line.startswith(("//", "#")) for line in lines if line)
    return dict(sorted(counts.items())) | {"in all": counts.total()}


# Rules.


def circles(arrows):
    """Ways among what stands in one folder that come back to their start."""
    return [f"circle: {' → '.join(map(name, way))}" for way in ways_round(arrows)]


def crowded_folders():
    """Folders with more doors than a reader can hold in mind."""
    return [f"{name(folder)} has {n} doors, over {MAX_DOORS}" for folder, n in doors() if n > MAX_DOORS]


def long_functions():
    """Functions of Rust over the limit, tests left out."""
    for path in written(".rs"):
        if TEST.search(name(path)) or "/tests/" in name(path):
            continue
        for line, function, n_lines in functions(path.read_text().splitlines()):
            if n_lines > MAX_FUNCTION_LINES:
                yield f"{name(path)}:{line} {function} has {n_lines} lines, over {MAX_FUNCTION_LINES}"


def wide_texts():
    """Lines of comments and of Markdown over their limits."""
    for path in written():
        if path.is_file():
            yield from wide_lines(path, name(path))


# Modules of both languages, and what they use.


def all_arrows():
    """Files by module, each with the files that it uses."""
    rust = {module: path for crate, folder in CRATES.items() for module, path in modules(crate, folder).items()}
    python = python_modules()
    arrows = {path: uses(module, path, rust) for module, path in rust.items()}
    return arrows | {path: imports(module, path, python) for module, path in python.items()}


def modules(crate, folder):
    """Files of a crate by the paths of their modules, `("gramian", "http", "wire")`."""
    found = {}
    for path in sorted(folder.rglob("*.rs")):
        parts = path.relative_to(folder).with_suffix("").parts
        if TEST.search(name(path)) or parts == ("main",):
            continue
        found[(crate, *(parts[:-1] if parts[-1] in ("mod", "lib") else parts))] = path
    return found


def uses(module, path, rust):
    """Files that a file of Rust names, in `use` or in a path."""
    text = without_tests(path.read_text())
    named = set()
    for statement in re.findall(r"^\s*(?:pub(?:\([^)]*\))? )?use ([^;]+);", text, re.M):
        named.update(unfolded(re.sub(r"\s+", "", statement)))
    code = re.sub(r"^\s*(?:pub(?:\([^)]*\))? )?use [^;]+;", "", text, flags=re.M)
    named.update(tuple(found.split("::")) for found in re.findall(r"\b[a-z_]\w*(?:::\w+)+", code))
    targets = (resolved(module, steps, rust) for steps in named)
    return {target for target in targets if target and target != path}


def without_tests(text):
    """A file without its comments and its module of tests."""
    return re.sub(r"//.*", "", text.split("#[cfg(test)]\nmod tests {")[0])


def unfolded(statement):
    """The paths of a `use`: `a::{b,c::{d,e}}` has three."""
    head, brace, rest = statement.partition("{")
    if not brace:
        return {tuple(head.removesuffix("::*").split("::"))}
    prefix = tuple(part for part in head.split("::") if part)
    return {prefix + steps for part in split_commas(rest[:-1]) for steps in unfolded(part)}


def split_commas(text):
    """Splits at the commas outside braces."""
    parts, depth = [""], 0
    for character in text:
        depth += (character == "{") - (character == "}")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return [part for part in parts if part]


def resolved(module, steps, rust):
    """The file of the longest beginning of a path that is a module."""
    base = module
    if steps[0] in ("crate", "self", "super"):
        base = module[:1] if steps[0] == "crate" else module
        steps = steps[1:] if steps[0] != "super" else steps
        while steps and steps[0] == "super":
            base, steps = base[:-1], steps[1:]
    elif steps[0] in CRATES:
        base, steps = steps[:1], steps[1:]
    elif (*module, steps[0]) not in rust:
        return None
    full = (*base, *(step for step in steps if step != "self"))
    while full and full not in rust:
        full = full[:-1]
    return rust.get(full)


def functions(lines):
    """Functions with bodies: the number of their first line, their name and how many lines they have."""
    for start, line in enumerate(lines):
        opening = re.match(r"( *)(?:pub(?:\([^)]*\))? )?(?:const )?(?:async )?fn (\w+)", line)
        if not opening or line.rstrip().endswith(("}", ";")):
            continue
        end = next((at for at in range(start, len(lines)) if lines[at].startswith(opening[1] + "}")), start)
        yield start + 1, opening[2], end - start + 1


def python_modules():
    """Files of the package by the paths of their modules."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        if "rest" not in parts:
            found[parts[:-1] if parts[-1] == "__init__" else parts] = path
    return found


def imports(module, path, python):
    """Files that a file of Python imports."""
    folder = module if path.name == "__init__.py" else module[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            base = folder[: len(folder) + 1 - node.level] if node.level else ()
            base += tuple(node.module.split(".")) if node.module else ()
            found.update(python.get((*base, alias.name)) or python.get(base) for alias in node.names)
    return found - {None, path}


# Graphs.


def ways_round(arrows):
    """The circles among what stands in one folder, one for each set of places that reach one another."""
    for folder in folders():
        beside = {}
        for path, targets in arrows.items():
            for target in targets:
                ends = [entry(folder, end) for end in (path, target)]
                if None not in ends and ends[0] != ends[1]:
                    beside.setdefault(ends[0], set()).add(ends[1])
        seen = set()
        for start in beside:
            way = None if start in seen else way_round(start, beside)
            if way:
                seen.update(way)
                yield [*way, start]


def way_round(start, arrows):
    """The shortest way from a place back to itself."""
    came, queue = {}, [start]
    for place in queue:
        for target in sorted(arrows.get(place, ())):
            if target == start:
                way = [place]
                while way[0] != start:
                    way.insert(0, came[way[0]])
                return way
            if target not in came:
                came[target] = place
                queue.append(target)
    return None


def entry(folder, path):
    """What stands in a folder and is or holds a file; none for the front of the folder."""
    if folder not in path.parents or (path.parent == folder and path.name in FRONTS):
        return None
    first = folder / path.relative_to(folder).parts[0]
    return first.with_suffix("") if first.suffix == ".rs" else first


def folders():
    """All folders of sources."""
    roots = [*CRATES.values(), PACKAGE]
    below = [path for root in roots for path in root.rglob("*") if path.is_dir()]
    return [path for path in [*roots, *below] if not {"rest", "__pycache__"} & set(path.parts)]


def doors():
    """How much stands in each folder; a file and the folder of its name are one door."""
    for folder in folders():
        inside = [path for path in folder.iterdir() if path.name not in {*FRONTS, "__pycache__", "rest"}]
        yield folder, len({path.with_suffix("") for path in inside if not TEST.search(name(path))})


if __name__ == "__main__":
    main()
