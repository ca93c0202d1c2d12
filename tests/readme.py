#!/usr/bin/env python3
"""Runs the examples of pages against a server and compares the answers.

    tests/readme.py [BASE_URL] [PAGE]…          asks the server at BASE_URL, http://localhost:8080 if absent
    tests/readme.py --binary GRAMIAN [PAGE]…    starts that binary for each page, on a free port, and ends it

Without pages it runs README.md, docs/walkthrough.md and docs/operations.md. No page depends on another.

Every ```sh block that contains curl is run by bash, in order, in the root of the repository. The server's
address replaces localhost:8080. The output is compared with the fenced block that follows, ```json or
```text:

- `…` matches anything: a JSON value, any run of entries of a list, any further members of an object, any part
  of a string, any number of lines of text.
- Numbers agree within RELATIVE of themselves, or within ROUNDING of the largest number of their list.
- The order of the members of an object does not matter. Every other order does.

If there are differences, prints them and exits with 1. Needs only the standard library.
"""

import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

from with_server import server

ROOT = Path(__file__).resolve().parent.parent
PAGES = ["README.md", "docs/walkthrough.md", "docs/operations.md"]

RELATIVE = 1e-6
ROUNDING = 1e-9
SECONDS_PER_EXAMPLE = 120
SHOWN_CHARACTERS = 3000

ANY = object()
NUMBER = re.compile(r"(?<![\w.-])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")


def main():
    arguments = argparse.ArgumentParser(description="Runs the examples of pages against a server.")
    arguments.add_argument("--binary", metavar="GRAMIAN", help="start this binary instead of asking a running server")
    arguments.add_argument("places", nargs="*", metavar="BASE_URL or PAGE")
    arguments = arguments.parse_args()
    bases = [place for place in arguments.places if "://" in place]
    pages = [Path(place).resolve() for place in arguments.places if "://" not in place]
    n_failed = 0
    for page in pages or [ROOT / page for page in PAGES]:
        if arguments.binary:
            with server(arguments.binary) as (base, _):
                n_failed += run(base, page)
        else:
            n_failed += run(bases[0].rstrip("/") if bases else "http://localhost:8080", page)
    sys.exit(1 if n_failed else 0)


def run(base, page):
    """Checks every example of a page. Returns how many fail."""
    examples = examples_of(page)
    if not examples:
        sys.exit(f"{page} has no ```sh block with curl")
    n_failed = 0
    for line, script, language, expected in examples:
        found, problems = check(script, language, expected, base)
        if problems:
            n_failed += 1
            print(f"{page.name}:{line}:\n{indented(script)}")
            print("\n".join(f"  {problem}" for problem in problems))
            print(f"  the whole answer:\n{indented(found[:SHOWN_CHARACTERS])}\n")
    n_good = len(examples) - n_failed
    print(f"{page.name}: {n_good} of {len(examples)} examples agree with the server at {base}", flush=True)
    return n_failed


def blocks_of(page):
    """Returns the fenced blocks of a page: (line, language, text)."""
    blocks, language, start, body = [], None, 0, []
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if not line.startswith("```"):
            body.append(line)
        elif language is None:
            language, start, body = line[3:].strip(), number, []
        else:
            blocks.append((start, language, "\n".join(body)))
            language = None
    return blocks


def examples_of(page):
    """Returns the examples of a page: (line, script, language of the answer, expected answer)."""
    blocks, examples = blocks_of(page), []
    for index, (line, language, script) in enumerate(blocks):
        if language == "sh" and re.search(r"\bcurl\b", script):
            _, kind, expected = blocks[index + 1] if index + 1 < len(blocks) else (0, None, "")
            if kind not in ("json", "text"):
                sys.exit(f"{page.name}:{line}: an example needs its answer in a ```json or ```text block behind it")
            examples.append((line, script, kind, expected))
    return examples


def check(script, language, expected, base):
    """Runs one example. Returns its output, and the differences from the expected one."""
    here = re.sub(r"(http://)?localhost:8080", lambda _: base, script)
    command = ["bash", "-euo", "pipefail", "-c", here]
    try:
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=SECONDS_PER_EXAMPLE)
    except subprocess.TimeoutExpired:
        return "", [f"no answer within {SECONDS_PER_EXAMPLE} s"]
    if run.returncode != 0:
        return run.stdout, [f"the command ends with status {run.returncode}: {run.stderr.strip()}"]
    if language == "text":
        lines = [ANY if line.strip() == "…" else line.rstrip() for line in expected.strip().splitlines()]
        return run.stdout, differences(lines, [line.rstrip() for line in run.stdout.strip().splitlines()])
    try:
        pattern = Pattern(expected).parse()
    except ValueError as error:
        return run.stdout, [f"the block on the page is not JSON with …: {error}"]
    try:
        return run.stdout, differences(pattern, json.loads(run.stdout))
    except ValueError as error:
        return run.stdout, [f"the answer is not JSON: {error}"]


def differences(pattern, answer, path="", scale=None):
    """Returns the differences between pattern and answer, in words. Empty if they match.

    `scale` is the largest number of the surrounding list.
    """
    if pattern is ANY:
        return []
    if isinstance(pattern, dict) and isinstance(answer, dict):
        return of_objects(pattern, answer, path)
    if isinstance(pattern, list) and isinstance(answer, list):
        return of_lists(pattern, answer, path, largest(pattern) if scale is None else scale)
    if is_number(pattern) and is_number(answer):
        close = are_close(pattern, answer, scale or 0.0)
    elif isinstance(pattern, str) and isinstance(answer, str):
        close = strings_match(pattern, answer)
    else:
        close = type(pattern) is type(answer) and pattern == answer
    return [] if close else [f"{path or 'the answer'}: the page has {shown(pattern)}, the server {shown(answer)}"]


def of_objects(pattern, answer, path):
    problems = []
    for name, value in pattern.items():
        if name is ANY:
            continue
        if name in answer:
            problems += differences(value, answer[name], f"{path}/{name}")
        else:
            problems.append(f"{path}/{name}: on the page, not in the answer")
    if ANY not in pattern:
        problems += [f"{path}/{name}: in the answer, not on the page" for name in answer if name not in pattern]
    return problems


def of_lists(pattern, answer, path, scale):
    if ANY not in pattern:
        if len(pattern) != len(answer):
            at = next((i for i, (p, a) in enumerate(zip(pattern, answer)) if differences(p, a, "", scale)), None)
            counts = f"the page has {len(pattern)} entries or lines, the server {len(answer)}"
            first = [] if at is None else differences(pattern[at], answer[at], f"{path}/{at}", scale)[:1]
            return [f"{path or 'the answer'}: {counts}", *first]
        return [d for i, (p, a) in enumerate(zip(pattern, answer)) for d in differences(p, a, f"{path}/{i}", scale)]
    runs = split_at_any(pattern)
    first, last = runs[0], runs[-1]
    if len(first) + len(last) > len(answer):
        return [f"{path or 'the answer'}: the page shows more entries or lines than the answer has"]
    problems = [d for i, p in enumerate(first) for d in differences(p, answer[i], f"{path}/{i}", scale)]
    end = len(answer) - len(last)
    problems += [d for i, p in enumerate(last) for d in differences(p, answer[end + i], f"{path}/{end + i}", scale)]
    at = len(first)
    for run in runs[1:-1]:
        fits = (i for i in range(at, end - len(run) + 1) if not of_lists(run, answer[i : i + len(run)], path, scale))
        found = next(fits, None)
        if found is None:
            return problems + [f"{path or 'the answer'}: nowhere in the answer is there {shown(run)}"]
        at = found + len(run)
    return problems


def split_at_any(pattern):
    runs = [[]]
    for entry in pattern:
        if entry is ANY:
            runs.append([])
        else:
            runs[-1].append(entry)
    return runs


def is_number(x):
    return isinstance(x, (int, float)) and not isinstance(x, bool)


def are_close(a, b, scale):
    return abs(a - b) <= RELATIVE * max(abs(a), abs(b)) + ROUNDING * scale


def largest(pattern):
    """Returns the largest absolute value of a list and the lists within it."""
    numbers = (largest(x) if isinstance(x, list) else abs(x) if is_number(x) else 0.0 for x in pattern)
    return max(numbers, default=0.0)


def strings_match(pattern, answer):
    """Compares strings literally, except that … matches anything and numbers need only be close."""
    numbers, regex = [], []
    for part in re.split("(…)", pattern):
        if part == "…":
            regex.append(".*?")
            continue
        end = 0
        for number in NUMBER.finditer(part):
            regex += [re.escape(part[end : number.start()]), f"({NUMBER.pattern})"]
            numbers.append(float(number.group()))
            end = number.end()
        regex.append(re.escape(part[end:]))
    match = re.fullmatch("".join(regex), answer, re.DOTALL)
    return match is not None and all(are_close(a, float(b), 0.0) for a, b in zip(numbers, match.groups()))


def shown(x):
    def plain(x):
        if isinstance(x, dict):
            return {"…" if k is ANY else k: plain(v) for k, v in x.items()}
        if isinstance(x, list):
            return [plain(v) for v in x]
        return "…" if x is ANY else x

    text = json.dumps(plain(x), ensure_ascii=False)
    return text if len(text) <= 300 else text[:300] + " …"


def indented(text):
    return "\n".join(f"    {line}" for line in text.splitlines())


class Pattern:
    """A parser for JSON in which … may stand for a value, a run of entries, or further members."""

    def __init__(self, text):
        self.text, self.at, self.decoder = text, 0, json.JSONDecoder()

    def parse(self):
        value = self.value()
        if self.peek():
            raise ValueError(f"{self.text[self.at:][:30]!r} behind its end")
        return value

    def peek(self):
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1
        return self.text[self.at : self.at + 1]

    def take(self, wanted):
        if self.peek() != wanted:
            raise ValueError(f"{wanted!r} expected before {self.text[self.at:][:30]!r}")
        self.at += 1

    def value(self):
        start = self.peek()
        if start == "…":
            self.at += 1
            return ANY
        if start == "{":
            return dict(self.sequence("{", "}", self.member))
        if start == "[":
            return list(self.sequence("[", "]", self.value))
        scalar, self.at = self.decoder.raw_decode(self.text, self.at)
        return scalar

    def member(self):
        if self.peek() == "…":
            self.at += 1
            return ANY, ANY
        name = self.value()
        self.take(":")
        return name, self.value()

    def sequence(self, opening, closing, entry):
        self.take(opening)
        while self.peek() != closing:
            yield entry()
            if self.peek() != closing:
                self.take(",")
        self.take(closing)


if __name__ == "__main__":
    main()
