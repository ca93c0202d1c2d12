"""Kernel evaluations per second on one core, as `cargo bench --bench kernels` prints them."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from ..report import Bound, Figure, Row
from ..setting import Setting

UNIT = "G pairs/s"

#: Smallest acceptable rates by family and quantity. Those of the Hessian apply with AVX-512 only.
BOUNDS = {("gauss", "gram"): 0.8, ("laplace", "hessian"): 0.45, ("gauss", "hessian"): 0.7}


@dataclass(frozen=True)
class Rate:
    """A rate that the benchmark printed, in G pairs/s.

    `instruction_set` is empty where the benchmark ran on the best one only.
    """

    instruction_set: str
    family: str
    quantity: str
    value: float


def measure(setting: Setting) -> Iterable[Row]:
    rates = parse(setting.output_of_bench("kernels"))
    with setting.gramian() as server:
        best_set = server.version()["instruction_set"]
    for rate in rates:
        limit = bound(rate, best_set, has_gram=any(other.quantity == "gram" for other in rates))
        where = f", {rate.instruction_set}" if rate.instruction_set else ""
        bounded = None if limit is None else Bound("figure", "≥", limit)
        yield Row(f"{rate.family}: {rate.quantity}{where}", Figure(rate.value, UNIT), bound=bounded)


def parse(output: str) -> list[Rate]:
    """Returns the rates in tables of `family  rate…` below a heading `d = 3, SET  quantity…`.

    A heading may have no title. Tables with other titles are left out.
    """
    rates: list[Rate] = []
    heading = ""
    for line in output.splitlines():
        row = re.fullmatch(r"(.*?\S)(\s{2,}\d+\.\d+(?:\s+\d+\.\d+)*)", line)
        if row is None:
            heading = line
            continue
        values = [float(cell) for cell in row[2].split()]
        words = heading.split()
        title, quantities = " ".join(words[: -len(values)]), words[-len(values) :]
        if title == "" or title.startswith("d = 3"):
            name = title.partition(", ")[2]
            rates += [Rate(name, row[1], quantity, value) for quantity, value in zip(quantities, values, strict=True)]
    return rates


def bound(rate: Rate, best_set: str, has_gram: bool) -> float | None:
    """Returns the bound of a rate on the best instruction set.

    Where the Gram matrix is not measured separately, sums of values stand for it.
    """
    if rate.instruction_set not in ("", best_set):
        return None
    quantity = rate.quantity.lower()
    kind = "hessian" if "hessian" in quantity else "gram" if quantity == ("gram" if has_gram else "value") else ""
    if kind == "hessian" and best_set != "AVX-512":
        return None
    return BOUNDS.get((re.split(r"[ ,]", rate.family.lower())[0], kind))
