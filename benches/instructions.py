#!/usr/bin/env python3
"""Counts the instructions of the hot parts and compares them with the committed baseline.

    benches/instructions.py            fails if a part takes over 5 % more or fewer than benches/instructions.tsv says
    benches/instructions.py --renew    writes the baseline

Times are noisy on shared machines, counts are not. valgrind's processor has AVX2 and no AVX-512, whatever the
machine has. So the counts are those of the AVX2 paths, on one thread. They depend on the compiler and on the
parts in benches/instructions.rs. Fewer instructions than the baseline are welcome: `--renew` then keeps the gain.
Needs cargo, valgrind and only the standard library.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BASELINE = ROOT / "benches/instructions.tsv"
TOLERANCE = 0.05
COUNTED = "*measured*"


def main():
    binary = build()
    names = re.findall(r"^part: (\w+)", output(binary), re.M)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(lambda name: count(binary, name), names))
    instruction_set = results[0][0]
    counts = {name: found for name, (_, found) in zip(names, results)}
    if sys.argv[1:] == ["--renew"]:
        tools = ", ".join(output(tool, "--version") for tool in ("rustc", "valgrind"))
        lines = [f"# {tools}, {instruction_set}, one thread; renewed by benches/instructions.py --renew"]
        lines += [f"{name}\t{found}" for name, found in counts.items()]
        BASELINE.write_text("\n".join(lines) + "\n")
    sys.exit(compare(counts, instruction_set))


def output(*command):
    """Returns the output of a command."""
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def build():
    """Builds the benchmark and returns the path of its binary."""
    command = ["cargo", "bench", "--locked", "--all-features", "--bench", "instructions", "--no-run", "--message-format=json"]
    messages = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    found = [json.loads(line).get("executable") for line in messages.splitlines() if '"instructions"' in line]
    return next(path for path in found if path)


def count(binary, name):
    """Returns the instruction set and the instruction count of one part."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "callgrind.out"
        command = ["valgrind", "--tool=callgrind", f"--toggle-collect={COUNTED}", f"--callgrind-out-file={out}"]
        ran = subprocess.run([*command, binary, name], capture_output=True, text=True)
        if ran.returncode != 0:
            sys.exit(f"{name} failed under valgrind:\n{ran.stderr}")
        total = re.search(r"^(?:totals|summary): (\d+)", out.read_text(), re.M)
    instruction_set = re.search(r"^instruction set: (.*)$", ran.stdout, re.M)
    if not total or int(total[1]) == 0:
        sys.exit(f"{name}: nothing was counted; is `measured` still a function of its own?")
    return instruction_set[1], int(total[1])


def compare(counts, instruction_set):
    """Prints the table, and returns the exit status."""
    header, *lines = BASELINE.read_text().splitlines()
    baseline = {name: int(found) for name, found in (line.split("\t") for line in lines)}
    if f", {instruction_set}, " not in header:
        print(f"not compared: this processor offers {instruction_set}, the baseline is of{header[1:]}")
        return 0
    print(f"{'instructions':24} {'now':>14} {'baseline':>14} {'ratio':>8}")
    apart = []
    for name in sorted(counts.keys() | baseline.keys()):
        now, before = counts.get(name), baseline.get(name)
        if now is None or before is None:
            apart.append(name)
            print(f"{name:24} {now or 'absent':>14} {before or 'absent':>14}")
            continue
        far = abs(now / before - 1) > TOLERANCE
        print(f"{name:24} {now:14,} {before:14,} {now / before:8.3f}{'  <--' if far else ''}")
        apart += [name] if far else []
    if apart:
        print(f"over {TOLERANCE:.0%} apart: {', '.join(apart)}; where that is meant: benches/instructions.py --renew")
    return 1 if apart else 0


if __name__ == "__main__":
    main()
