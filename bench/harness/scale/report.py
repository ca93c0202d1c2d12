"""Rows of the table of `bench/scale`: pieces of work, who did them, and bounds on gramian."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from ..report import significant

OURS = "gramian"


@dataclass(frozen=True)
class Figure:
    """A number with its unit: s, B, °, % or none."""

    value: float
    unit: str = ""

    def __str__(self) -> str:
        if not math.isfinite(self.value):
            return "∞"
        if self.unit == "s":
            return f"{significant(1e3 * self.value)} ms" if self.value < 1 else f"{significant(self.value)} s"
        if self.unit == "B":
            return f"{self.value / 1e9:.2f} GB"
        return f"{significant(self.value)}{'' if self.unit in ('°', '') else ' '}{self.unit}"


@dataclass(frozen=True)
class Bound:
    """A bound on a figure of gramian.

    `limit` is a number, or the beginning of the name of peers whose figure must be greater.
    """

    figure: str
    relation: Literal["≤", "≥", "<"]
    limit: float | str

    def holds(self, ours: "Entry", peers: "Iterable[Entry]") -> bool:
        value = ours.figures[self.figure].value
        if isinstance(self.limit, str):
            rivals = [peer.figures[self.figure].value for peer in peers if peer.who.startswith(self.limit)]
            return value < min(rivals, default=math.inf)
        return value <= self.limit if self.relation == "≤" else value >= self.limit

    def text(self, unit: str) -> str:
        limit = self.limit if isinstance(self.limit, str) else str(Figure(self.limit, unit))
        name = "" if self.figure in ("time", "memory") else f"{self.figure} "
        return f"{name}{self.relation} {limit}"


@dataclass(frozen=True)
class Entry:
    """The figures of gramian or of a peer. `missing` says why there are none."""

    who: str
    figures: Mapping[str, Figure] = field(default_factory=dict)
    remark: str = ""
    missing: str = ""


@dataclass(frozen=True)
class Work:
    """A row of the table that is still to be measured.

    `ours` returns the entry of gramian, `peers` those of the peers. `units` are the units of bounded figures.
    """

    what: str
    bounds: tuple[Bound, ...]
    units: Mapping[str, str]
    ours: Callable[[], Entry]
    peers: Callable[[], Iterable[Entry]]

    def unit(self, figure: str) -> str:
        return {"time": "s", "memory": "B"}.get(figure) or self.units.get(figure, "")


@dataclass(frozen=True)
class Measured:
    """A measured row with its entries."""

    work: Work
    ours: Entry
    peers: tuple[Entry, ...]

    @property
    def is_served(self) -> bool:
        return not self.ours.missing

    @property
    def short(self) -> list[str]:
        """Returns the names of the figures whose bounds do not hold."""
        bounds = () if self.ours.missing else self.work.bounds
        return list(dict.fromkeys(bound.figure for bound in bounds if not bound.holds(self.ours, self.peers)))

    @property
    def verdict(self) -> str:
        if self.ours.missing:
            return "not served"
        return f"falls short: {', '.join(self.short)}" if self.short else "holds"


COLUMNS = ("work", "", "time", "peak memory", "accuracy", "verdict")


def lines(measured: Measured) -> list[tuple[str, ...]]:
    """Returns the lines of a row: the bounds, then gramian, then the peers."""
    work = measured.work
    limits = {name: [b.text(work.unit(name)) for b in work.bounds if b.figure == name] for name in ("time", "memory")}
    others = [bound.text(work.unit(bound.figure)) for bound in work.bounds if bound.figure not in limits]
    asked = (", ".join(limits["time"]), ", ".join(limits["memory"]), ", ".join(others))
    rows = [(work.what, "asked", *asked, "")]
    for entry in (measured.ours, *measured.peers):
        rows.append(("", entry.who, *_cells(entry), measured.verdict if entry is measured.ours else ""))
    return rows


def _cells(entry: Entry) -> tuple[str, str, str]:
    if entry.missing:
        return "", "", f"not served ({entry.missing})" if entry.who == OURS else entry.missing
    accuracy = [f"{name} {figure}" for name, figure in entry.figures.items() if name not in ("time", "memory")]
    time, memory = (str(entry.figures[name]) if name in entry.figures else "" for name in ("time", "memory"))
    text = ", ".join(accuracy) + (f"; {entry.remark}" if entry.remark and accuracy else entry.remark)
    return time, memory, text


def markdown(rows: Iterable[Measured]) -> str:
    """Formats all rows as a Markdown table."""
    table = [COLUMNS, ("---", "---", "---:", "---:", "---", "---")]
    for row in rows:
        table += [(_strong(line[0]), *line[1:]) for line in lines(row)]
    return "\n".join("| " + " | ".join(line) + " |" for line in table)


def plain(row: Measured) -> str:
    """Formats a row for a terminal."""
    first, *others = lines(row)
    text = [f"-- {first[0]}"]
    for _, who, time, memory, accuracy, verdict in (first, *others):
        text.append(f"   {who:<34} {time:>10} {memory:>10}  {accuracy}{f'  [{verdict}]' if verdict else ''}")
    return "\n".join(text)


def _strong(text: str) -> str:
    return f"**{text}**" if text else ""
