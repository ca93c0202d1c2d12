"""The command line: which groups to measure, and where the figures go."""

import argparse
import json
import subprocess
import sys
import time
from dataclasses import asdict
from pathlib import Path

from . import machine
from .groups import GROUPS
from .report import Group, markdown, plain
from .setting import Setting

#: Number of cores in use before or after the run, above which its times count as disturbed.
MAX_BUSY_CORES = 0.2

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    arguments = parse()
    setting = Setting.of(ROOT, arguments.quick, arguments.with_gpytorch)
    busy = [machine.busy_cores()]
    facts = machine.describe(setting)
    groups = []
    for name in arguments.group or GROUPS:
        title, measure = GROUPS[name]
        began = time.monotonic()
        group = Group(name, title, tuple(measure(setting)))
        groups.append(group)
        print(plain(group), f"   ({time.monotonic() - began:.0f} s)", sep="\n", flush=True)
    busy.append(machine.busy_cores())
    facts.append(("cores that others used", f"{busy[0]:.1f} before the run, {busy[1]:.1f} after it"))
    write_json(groups, facts)
    if not arguments.group and not arguments.quick:
        write_results(groups, facts, is_disturbed=max(busy) > MAX_BUSY_CORES)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="bench/run", description="Measures gramian beside its references.")
    parser.add_argument("--quick", action="store_true", help="small sizes and one round: tests the harness, not gramian")
    parser.add_argument("--with-gpytorch", action="store_true", help="also GPyTorch on the CPU: a download of gigabytes")
    parser.add_argument("group", nargs="*", help=f"of {', '.join(GROUPS)}; all if absent")
    arguments = parser.parse_args()
    if unknown := set(arguments.group) - set(GROUPS):
        parser.error(f"no such group: {', '.join(sorted(unknown))}")
    return arguments


def write_json(groups: list[Group], facts: list[tuple[str, str]]) -> None:
    """Writes every figure with its verdict to bench/results.json, for plots."""
    rows = {group.name: [{**asdict(row), "ratio": row.ratio, "holds": row.holds} for row in group.rows] for group in groups}
    document = {"machine": dict(facts), "command": sys.argv[1:], "groups": rows}
    (ROOT / "bench" / "results.json").write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")


def write_results(groups: list[Group], facts: list[tuple[str, str]], is_disturbed: bool) -> None:
    rows = [row for group in groups for row in group.rows]
    bounded = [row for row in rows if row.bound is not None]
    held = sum(row.holds is True for row in bounded)
    short = sum(row.holds is False for row in bounded)
    summary = f"Of {len(bounded)} bounds {held} hold, {short} fall short, {len(bounded) - held - short} are not measured."
    if is_disturbed:
        summary += " **The machine was not idle: all times are disturbed, and verdicts may be chance.**"
    notes = (ROOT / "bench" / "notes.md").read_text().strip()
    parts = [
        "# Results\n\nWritten by `bench/run`; [README.md](README.md) explains how to read it. Times are the best of several "
        "rounds in which ours and the reference take turns, and in brackets the median; the ratio is that of the best, and in "
        f"brackets that of the medians. {summary}",
        "\n".join(["| | |", "|---|---|", *(f"| {name} | {value} |" for name, value in facts)]),
        markdown(groups).strip(),
        f"## Where a figure does not hold\n\n{notes}",
        f"## Time and memory against n\n\n![growth](../docs/growth.svg)\n\n{growth()}",
    ]
    (ROOT / "bench" / "RESULTS.md").write_text("\n\n".join(parts) + "\n")


def growth() -> str:
    """Draws docs/growth.svg and returns the table behind it."""
    table = ROOT / "bench" / "growth.md"
    subprocess.run([sys.executable, ROOT / "bench" / "growth.py", "--table", table], check=True, stdout=subprocess.DEVNULL)
    return table.read_text().strip()


if __name__ == "__main__":
    main()
