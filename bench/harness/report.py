"""Rows of the tables that `bench/run` writes: figures, bounds, verdicts."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from .timing import Times

UNITS_OF_SECONDS = {"s": 1.0, "ms": 1e3, "µs": 1e6}


@dataclass(frozen=True)
class Figure:
    """A number with its unit.

    `median` is set where the value is the best of several rounds.
    """

    value: float
    unit: str
    median: float | None = None

    @classmethod
    def of(cls, times: Times, unit: str = "ms") -> "Figure":
        factor = UNITS_OF_SECONDS[unit]
        return cls(times.best * factor, unit, times.median * factor)

    @classmethod
    def rate(cls, amount: float, times: Times, unit: str) -> "Figure":
        """Returns `amount` per second in the best round, and in the median round."""
        return cls(amount / times.best, unit, amount / times.median)

    def __str__(self) -> str:
        text = f"{significant(self.value)} {self.unit}".rstrip()
        return text if self.median is None else f"{text} ({significant(self.median)})"


@dataclass(frozen=True)
class Bound:
    """A limit for `ours`, the ratio ours/reference, the speedup reference/ours, or ours − reference."""

    quantity: Literal["figure", "ratio", "speedup", "difference"]
    relation: Literal["≤", "≥"]
    limit: float

    def __str__(self) -> str:
        names = {"figure": "", "ratio": "ratio ", "speedup": "speedup ", "difference": "difference "}
        return f"{names[self.quantity]}{self.relation} {self.limit:g}"


@dataclass(frozen=True)
class Row:
    """A line of the table.

    `ours` is None where the figure cannot be measured. `remark` then says why. In a contest the reference is
    a peer, and the verdict names the winner. `more_is_better` is set for rates.
    """

    what: str
    ours: Figure | None
    reference: Figure | None = None
    bound: Bound | None = None
    remark: str = ""
    is_contest: bool = False
    more_is_better: bool = False

    @property
    def ratio(self) -> float | None:
        if self.ours is None or self.reference is None or self.reference.value == 0:
            return None
        return self.ours.value / self.reference.value

    @property
    def holds(self) -> bool | None:
        """True if the bound holds, None without a bound or a figure."""
        shortfall = self._shortfall()
        return None if shortfall is None else shortfall <= 0

    @property
    def verdict(self) -> str:
        if self.ours is None:
            return "not measured"
        shortfall = self._shortfall()
        if shortfall is not None:
            return "holds" if shortfall <= 0 else f"falls short by {self._describe(shortfall)}"
        return self._winner() if self.is_contest else ""

    def _measured(self, bound: Bound) -> float | None:
        if self.ours is None:
            return None
        if bound.quantity == "figure":
            return self.ours.value
        if self.reference is None:
            return None
        if bound.quantity == "difference":
            return self.ours.value - self.reference.value
        ratio = self.ours.value / self.reference.value
        return 1 / ratio if bound.quantity == "speedup" else ratio

    def _shortfall(self) -> float | None:
        """Returns the distance beyond the bound: relative to the bound, or in its unit for a difference.

        It is negative or zero where the bound holds.
        """
        measured = None if self.bound is None else self._measured(self.bound)
        if self.bound is None or measured is None:
            return None
        excess = measured - self.bound.limit if self.bound.relation == "≤" else self.bound.limit - measured
        return excess if self.bound.quantity == "difference" else excess / self.bound.limit

    def _describe(self, shortfall: float) -> str:
        if self.bound is not None and self.bound.quantity == "difference" and self.ours is not None:
            return f"{significant(shortfall)} {self.ours.unit}"
        return f"{100 * shortfall:.1f} %"

    def _winner(self) -> str:
        ratio = self.ratio
        if ratio is None or ratio == 0:
            return ""
        advantage = ratio if self.more_is_better else 1 / ratio
        return f"ours wins, {significant(advantage)} ×" if advantage >= 1 else f"the peer wins, {significant(1 / advantage)} ×"


@dataclass(frozen=True)
class Group:
    """The rows that one module measures, with their common name and title."""

    name: str
    title: str
    rows: tuple[Row, ...]


def significant(value: float) -> str:
    """Formats a number with three significant digits, without an exponent where that is readable."""
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        digits = 3 if value == 0 else max(0, 2 - _decade(value))
        return f"{value:.{digits}f}"
    return f"{value:.2e}"


def _decade(value: float) -> int:
    return int(f"{value:e}".partition("e")[2])


def markdown(groups: Iterable[Group]) -> str:
    """Formats a Markdown table per group."""
    sections = []
    for group in groups:
        lines = [
            f"### {group.title}",
            "",
            "| what | ours | reference | ratio | bound | verdict | remark |",
            "|---|---:|---:|---:|---|---|---|",
        ]
        lines += ["| " + " | ".join(_cells(row)) + " |" for row in group.rows]
        sections.append("\n".join(lines))
    return "\n\n".join(sections) + "\n"


def plain(group: Group) -> str:
    """Formats a group for a terminal."""
    lines = [f"-- {group.name}: {group.title}"]
    for row in group.rows:
        what, ours, reference, ratio, bound, verdict, remark = _cells(row)
        lines.append(f"   {what}: {ours} | {reference} | {ratio} | {bound} | {verdict}" + (f" [{remark}]" if remark else ""))
    return "\n".join(lines)


def _cells(row: Row) -> list[str]:
    figures = ["" if figure is None else str(figure) for figure in (row.ours, row.reference)]
    return [row.what, *figures, _ratios(row), "" if row.bound is None else str(row.bound), row.verdict, row.remark]


def _ratios(row: Row) -> str:
    """Formats the ratio, with the ratio of the medians in brackets."""
    if row.ratio is None or row.ours is None or row.reference is None:
        return ""
    if row.ours.median is None or not row.reference.median:
        return significant(row.ratio)
    return f"{significant(row.ratio)} ({significant(row.ours.median / row.reference.median)})"
