"""The command line of `bench/scale`."""

import argparse
import fnmatch
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .. import machine
from ..report import significant
from ..setting import N_THREADS, Setting
from . import growth
from .data import Dragon, describe
from .iterative import Iterative
from .landmarks import Landmarks
from .level_sets import LevelSets
from .peers import Peers
from .report import OURS, Entry, Measured, Work, markdown, plain
from .service import NotServed, Service, use_cores
from .table import Table

ROOT = Path(__file__).resolve().parents[3]
BINARY = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "gramian"


#: What is measured against the number of points, by the name of its drawing.
GROWN = {"scale": growth.LOCAL, "solvers": growth.SOLVERS}


def main() -> None:
    arguments = parse()
    if not arguments.binary.exists():
        sys.exit(f"there is no {arguments.binary}")
    use_cores(N_THREADS)
    setting = Setting(ROOT, arguments.quick, arguments.with_gpytorch)
    fields = {"solver": arguments.solver} if arguments.solver else {}
    service = Service(setting, arguments.binary, fields)
    peers, dragon = Peers(setting, arguments.cached_peers), Dragon(setting.build / "scale")
    works = {
        **Table(setting, service, peers, dragon).works(),
        **LevelSets(setting, service, peers, dragon).works(),
        **Landmarks(setting, service, peers).works(),
        **Iterative(setting, service, peers, dragon).works(),
    }
    chosen = choose([*works, *GROWN], arguments.row)
    busy = [machine.busy_cores()]
    rows = {name: measure(name, works[name](), arguments) for name in works if name in chosen}
    grown = {name: grow(setting, service, name) for name in GROWN if name in chosen}
    busy.append(machine.busy_cores())
    facts = describe_run(setting, service, dragon, busy)
    write_json(facts, rows, grown)
    if not arguments.row and not arguments.quick:
        write_pages(facts, rows, grown, arguments.cached_peers)
    unserved = [name for name, row in rows.items() if row.ours.missing]
    unserved += [name for name, found in grown.items() if found.refusal]
    if unserved:
        sys.exit(f"not served: {', '.join(unserved)}")
    if arguments.strict and (short := [name for name, row in rows.items() if row.short]):
        sys.exit(f"bounds do not hold: {', '.join(short)}")


def choose(names: list[str], patterns: list[str]) -> list[str]:
    """Returns the names that match a pattern, or all of them if there is none."""
    for pattern in patterns:
        if not fnmatch.filter(names, pattern):
            sys.exit(f"no such row: {pattern}; there are {', '.join(names)}")
    return [name for name in names if not patterns or any(fnmatch.fnmatch(name, pattern) for pattern in patterns)]


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="bench/scale", description="Measures clouds of up to a million points beside the peers, on 2 cores."
    )
    parser.add_argument("--quick", action="store_true", help="a few thousand points: tests the harness, not gramian")
    parser.add_argument("--binary", type=Path, default=BINARY, help="a server already built")
    parser.add_argument("--solver", help="added to every request that names none, to see what one does that `auto` leaves out")
    parser.add_argument("--with-gpytorch", action="store_true", help="also GPyTorch on the CPU: a download of gigabytes")
    parser.add_argument("--no-peers", action="store_true", help="gramian alone")
    parser.add_argument("--cached-peers", action="store_true", help="peers are not run again on what they were run on before")
    parser.add_argument("--strict", action="store_true", help="fails if a bound of a row does not hold")
    parser.add_argument("row", nargs="*", help="of the table, or scale, or solvers, or patterns such as 'mesh-*'; all if absent")
    return parser.parse_args()


def measure(name: str, work: Work, arguments: argparse.Namespace) -> Measured:
    began = time.monotonic()
    try:
        ours = work.ours()
    except NotServed as error:
        ours = Entry(OURS, missing=str(error))
    except KeyError as error:
        ours = Entry(OURS, missing=f"the answer has no {error}")
    row = Measured(work, ours, () if arguments.no_peers else tuple(peers_of(work)))
    print(plain(row), f"   ({name}, {time.monotonic() - began:.0f} s)", sep="\n", flush=True)
    return row


def peers_of(work: Work) -> Iterable[Entry]:
    """Yields the entries of the peers. Peers that follow a failing one are not measured."""
    try:
        yield from work.peers()
    except subprocess.CalledProcessError as error:
        yield Entry(Path(error.cmd[0]).name, missing=f"{' '.join(error.cmd[1:])} ended with {error.returncode}")


@dataclass(frozen=True)
class Grown:
    """Costs against the number of points, or the reason why there are none."""

    rows: list[growth.Row]
    refusal: str = ""


def grow(setting: Setting, service: Service, name: str) -> Grown:
    print(f"-- {name}", flush=True)
    sizes = growth.QUICK_SIZES if setting.is_quick else growth.SIZES
    try:
        return Grown(growth.measure(service, GROWN[name], sizes))
    except NotServed as error:
        print(f"   not served ({error})", flush=True)
        return Grown([], f"not served ({error})")


def describe_run(setting: Setting, service: Service, dragon: Dragon, busy: list[float]) -> list[tuple[str, str]]:
    """Describes the machine and the data as names and values."""
    facts = machine.facts(setting, service.version())
    for level in (1, 2):
        scan = dragon.scan(level)
        found = describe(scan.points)
        nearest, fourth = (significant(1e3 * found[name]) for name in ("nearest", "fourth"))
        n_unknown = int((abs(scan.normals).sum(axis=1) == 0).sum())
        text = f"{found['n']:,} distinct points, {nearest} mm to the nearest and {fourth} mm to the fourth other one (medians)"
        facts.append((f"dragon {level}", f"{text}; {n_unknown:,} of them without a normal of the mesh, left out"))
    facts.append(("cores that others used", f"{busy[0]:.1f} before the run, {busy[1]:.1f} after it"))
    return facts


def write_json(facts: list[tuple[str, str]], rows: dict[str, Measured], grown: dict[str, Grown]) -> None:
    def entry(found: Entry) -> dict[str, Any]:
        figures = {name: asdict(figure) for name, figure in found.figures.items()}
        return {"who": found.who, "figures": figures, "remark": found.remark, "missing": found.missing}

    table = {
        name: {
            "what": row.work.what,
            "bounds": [asdict(bound) for bound in row.work.bounds],
            "verdict": row.verdict,
            "entries": [entry(found) for found in (row.ours, *row.peers)],
        }
        for name, row in rows.items()
    }
    document = {
        "machine": dict(facts),
        "command": sys.argv[1:],
        "rows": table,
        **{name: found.rows for name, found in grown.items()},
    }
    (ROOT / "bench" / "scale.json").write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")


def write_pages(facts: list[tuple[str, str]], rows: dict[str, Measured], grown: dict[str, Grown], has_cached_peers: bool) -> None:
    """Writes bench/SCALE.md, and the drawings and figures of docs/scale.md."""
    holds = sum(row.verdict == "holds" for row in rows.values())
    unserved = sum(bool(row.ours.missing) for row in rows.values())
    summary = f"Of {len(rows)} rows {holds} hold, {len(rows) - holds - unserved} fall short, {unserved} are not served."
    if has_cached_peers:
        summary += " Figures of the peers are of an earlier run on this machine."
    page, sections = ROOT / "docs" / "scale.md", []
    for name, found in grown.items():
        if found.rows:
            growth.draw(found.rows, GROWN[name], ROOT / "docs" / f"{name}.svg")
            table = growth.table(found.rows, GROWN[name])
            fill(page, name, table)
            sections.append(f"## {name.capitalize()}\n\n![{name}](../docs/{name}.svg)\n\n{table}")
        else:
            sections.append(f"## {name.capitalize()}\n\n{found.refusal}")
    if grown["scale"].rows:
        fill(page, "paper", growth.on_paper(grown["scale"].rows[-1]))
    parts = [
        "# Scale",
        f"Written by `bench/scale`; [docs/scale.md](../docs/scale.md) says what the rows mean. {summary}",
        "\n".join(["| | |", "|---|---|", *(f"| {name} | {value} |" for name, value in facts)]),
        markdown(rows.values()),
        *sections,
    ]
    (ROOT / "bench" / "SCALE.md").write_text("\n\n".join(parts) + "\n")


def fill(page: Path, name: str, content: str) -> None:
    """Replaces the text between two marks of a page."""
    opening, closing = f"<!-- {name}: written by bench/scale -->", f"<!-- end of {name} -->"
    before, _, rest = page.read_text().partition(opening)
    _, _, after = rest.partition(closing)
    page.write_text(f"{before}{opening}\n{content}\n{closing}{after}")


if __name__ == "__main__":
    main()
