"""Kernel evaluations per second on one core, as `cargo bench --bench kernels` prints them."""

import re
from collections.abc import Iterable

from ..report import Bound, Figure, Row
from ..setting import Setting

UNIT = "G pairs/s"

#: Smallest rates by family and quantity; those of the Hessian are asked for with AVX-512 only.
BOUNDS = {("gauss", "gram"): 0.8, ("laplace", "hessian"): 0.45, ("gauss", "hessian"): 0.7}


def measure(setting: Setting) -> Iterable[Row]:
    rates = parse(setting.output_of_bench("kernels", ["--machine"]))
    with setting.gramian() as server:
        has_avx512 = server.version()["instruction_set"] == "AVX-512"
    for (family, quantity), rate in rates.items():
        limit = bound(family, quantity, has_avx512, any("gram" in name.lower() for _, name in rates))
        yield Row(f"{family}: {quantity}", Figure(rate, UNIT), bound=None if limit is None else Bound("figure", "≥", limit))


def parse(output: str) -> dict[tuple[str, str], float]:
    """Rates by family and quantity: from lines `family: quantity<TAB>figure<TAB>unit`, or from a table with a header."""
    tabbed = [line.split("\t") for line in output.splitlines() if line.count("\t") == 2]
    if tabbed:
        named = ((name.rpartition(":"), float(figure)) for name, figure, _unit in tabbed)
        return {(family.strip(), quantity.strip()): rate for (family, _, quantity), rate in named}
    header: list[str] = []
    rates = {}
    for line in output.splitlines():
        family, *cells = line.rsplit(maxsplit=len(header)) if header else [""]
        if line.startswith(" "):
            header = line.split()
        elif header and len(cells) == len(header):
            rates.update({(family.strip(), quantity): float(cell) for quantity, cell in zip(header, cells, strict=True)})
    return rates


def bound(family: str, quantity: str, has_avx512: bool, has_gram: bool) -> float | None:
    """The bound of a rate; sums of values stand for the Gram matrix where that is not measured by itself."""
    asks = quantity.lower()
    kind = "hessian" if "hessian" in asks else "gram" if "gram" in asks or (asks == "value" and not has_gram) else ""
    if kind == "hessian" and not has_avx512:
        return None
    return BOUNDS.get((re.split(r"[ ,]", family.lower())[0], kind))
