"""Factorization and operators.

The factorization is compared with the matrix product and with LAPACK. Operators are compared with a
factorization and its solves.
"""

from collections.abc import Iterable

from ..report import Bound, Figure, Row
from ..setting import Setting
from ..timing import Times, fastest

LENGTH_SCALE, ALPHA = 0.2, 1e-6

#: Numbers of threads to try: OpenBLAS is sometimes faster on one thread for small matrices.
THREADS = (1, 2)


def measure(setting: Setting) -> Iterable[Row]:
    yield from cholesky(setting)
    yield from operators(setting)


def cholesky(setting: Setting) -> Iterable[Row]:
    n = setting.size(4000)
    ours: list[dict[str, float]] = []
    theirs: list[dict[str, float]] = []
    with setting.bench("factor", str(n)) as bench, setting.lapack(n, LENGTH_SCALE, ALPHA) as lapack:
        for _ in range(setting.rounds(8) + 1):
            ours.append(bench.ask())
            theirs.append({f"{threads}": lapack.ask(f"dpotrf {threads}")["dpotrf"] for threads in THREADS})
            theirs[-1]["dgemm"] = lapack.ask("dgemm 2")["dgemm"]
    parts, reference = collect(ours), collect(theirs)
    factor, product, dgemm = parts["factor"], parts["product"], reference.pop("dgemm")
    threads, dpotrf = fastest(reference)
    flops = n**3 / 1e9
    rate = Figure.rate(flops / 3, factor, "GFLOP/s")
    what = f"Cholesky, n = {n:,}"
    yield Row(
        f"{what}: rate beside our matrix product (faer)",
        rate,
        Figure.rate(2 * flops, product, "GFLOP/s"),
        Bound("ratio", "≥", 0.78),
        more_is_better=True,
    )
    yield Row(
        f"{what}: rate beside OpenBLAS dgemm",
        rate,
        Figure.rate(2 * flops, dgemm, "GFLOP/s"),
        more_is_better=True,
        remark="for comparison: the product of the reference",
    )
    yield Row(
        f"{what}: speed beside dpotrf",
        Figure.of(factor),
        Figure.of(dpotrf),
        Bound("speedup", "≥", 0.95),
        f"the `factor` stage in a process of its own, in turn with dpotrf on the same matrix; its threads: {threads}",
    )
    yield Row(f"Gram matrix, n = {n:,}", Figure.of(parts["gram"]), remark="lower triangle, 2 threads")
    yield Row(f"condition estimate, n = {n:,}", Figure.of(parts["condition"]), remark="part of every factorization")


def operators(setting: Setting) -> Iterable[Row]:
    n = setting.size(2000)
    ours: list[dict[str, float]] = []
    theirs: list[dict[str, float]] = []
    asked = {"dpotrf": "", "dpotrs": f" {n}", "dtrsm": f" {n // 2}"}
    with setting.bench("operators", str(n)) as bench, setting.lapack(n, LENGTH_SCALE, ALPHA) as lapack:
        for _ in range(setting.rounds(8) + 1):
            ours.append(bench.ask())
            calls = [(routine, threads, rest) for routine, rest in asked.items() for threads in THREADS]
            theirs.append({f"{name} {threads}": lapack.ask(f"{name} {threads}{rest}")[name] for name, threads, rest in calls})
    parts, lapack_times = collect(ours), collect(theirs)
    best = {name: fastest({str(t): lapack_times[f"{name} {t}"] for t in THREADS})[1] for name in asked}
    solve = {"LAPACK": best["dpotrf"] + best["dpotrs"], "faer": parts["reference_factor"] + parts["reference_solve"]}
    forward = {"LAPACK": best["dpotrf"] + best["dtrsm"], "faer": parts["reference_factor"] + parts["reference_forward"]}
    wholes = [
        (f"Laplace–Beltrami matrix, m = n = {n:,}", "laplace_beltrami", solve, f"solves with {n:,} columns"),
        (
            f"posterior variances, n = {n:,}, m = {n // 2:,}",
            "variances",
            forward,
            f"a forward solve with {n // 2:,} columns",
        ),
    ]
    for what, part, references, solves in wholes:
        name, reference = fastest(references)
        remark = f"ours from the points on; reference: factorization and {solves}, {name} (the faster of LAPACK and faer)"
        yield Row(f"{what}, cold", Figure.of(parts[part]), Figure.of(reference), Bound("ratio", "≤", 1.3), remark)
        yield Row(
            f"{what}, beyond the factorization",
            Figure.of(minus(parts[part], parts["factorize"])),
            remark="a factorization with Gram matrix and condition takes " + str(Figure.of(parts["factorize"])),
        )


def collect(rounds: list[dict[str, float]]) -> dict[str, Times]:
    """Collects times by part over all rounds but the first, which warmed up."""
    return {part: Times(tuple(spent[part] for spent in rounds[1:])) for part in rounds[0]}


def minus(whole: Times, part: Times) -> Times:
    return Times(tuple(a - b for a, b in zip(whole.seconds, part.seconds, strict=True)))
