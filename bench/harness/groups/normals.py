"""`POST /v1/normals`, and curvatures of small clouds.

Cold requests are compared with LAPACK's factorization alone, warm requests with the evaluation alone.
"""

from collections.abc import Iterable
from typing import Any

from ..clouds import sphere
from ..report import Bound, Figure, Row
from ..server import Answer
from ..setting import Setting
from ..timing import Times, alternate, fastest

MATERN = {"family": "matern", "nu": 2.5, "length_scale": 0.2}
LAPLACE = {"family": "laplace", "epsilon": 1, "length_scale": 0.2}
DEFAULT_ALPHA = 1e-10
COLD = Bound("ratio", "≤", 1.3)
WARM = Bound("ratio", "≤", 1.5)
BEYOND = Bound("figure", "≤", 25)
SMALL = Bound("ratio", "≤", 3)


def measure(setting: Setting) -> Iterable[Row]:
    n = setting.size(4000)
    yield from cold(setting, n)
    yield from warm(setting, n)
    yield small_curvatures(setting, 256)


def cold(setting: Setting, n: int) -> Iterable[Row]:
    """Measures cold requests: every round has a new cloud.

    Depending on the kind, the cloud of the last round is deleted with its results, or stays in the cache.
    """
    kinds: dict[str, tuple[dict[str, Any] | None, bool]] = {
        "Matérn 5/2": (MATERN, True),
        "Laplace, epsilon 1": (LAPLACE, True),
        "no kernel given": (None, True),
        "Matérn 5/2, earlier clouds still cached": (MATERN, False),
    }
    with setting.gramian() as server, setting.lapack(n, MATERN["length_scale"], DEFAULT_ALPHA) as lapack:
        client = server.client()
        last: dict[str, Answer] = {}
        beyond: dict[str, list[float]] = {what: [] for what in kinds}

        def ask(index: int, what: str, kernel: dict[str, Any] | None, forgets: bool, round_number: int) -> float:
            last[what] = client.post("/v1/normals", request(n, 0.01 * round_number + 0.002 * index, kernel))
            if forgets:
                client.forget(last[what])
            spent = last[what].seconds
            beyond[what].append(spent - last[what].stages["gram"] - last[what].stages["factor"])
            return spent

        tasks = {
            what: lambda number, i=index, w=what, k=kernel, f=forgets: ask(i, w, k, f, number)
            for index, (what, (kernel, forgets)) in enumerate(kinds.items())
        }
        for threads in (1, 2):
            tasks[f"dpotrf {threads}"] = lambda _, t=threads: lapack.ask(f"dpotrf {t}")["dpotrf"]
        times = alternate(setting.rounds(6), tasks)
    _, dpotrf = fastest({name: times[name] for name in ("dpotrf 1", "dpotrf 2")})
    for what, (_, forgets) in kinds.items():
        remark = "last round: " + stages(last[what]) + ("" if forgets else "; a buffer that was never touched before")
        bound = COLD if forgets else None
        yield Row(f"cold, n = m = {n:,}, {what}", Figure.of(times[what]), Figure.of(dpotrf), bound, remark)
    rest = Figure.of(Times(tuple(beyond["no kernel given"][1:])))
    yield Row(f"cold, n = m = {n:,}, no kernel given: beyond factorization and Gram matrix", rest, bound=BEYOND)


def warm(setting: Setting, n: int) -> Iterable[Row]:
    """Measures a repeated request, and new queries on a known cloud.

    Reference: the fused pass of value, gradient and Hessian alone, in the process.
    """
    first = sphere(n)
    with setting.gramian() as server, setting.bench("operators", str(n)) as bench:
        client = server.client()
        client.post("/v1/normals", request(n, 0.0, MATERN))
        fresh: list[Answer] = []

        def again(_: int) -> float:
            return client.post("/v1/normals", request(n, 0.0, MATERN)).seconds

        def new_queries(round_number: int) -> float:
            queries = sphere(n, 0.1 + 0.01 * round_number)
            body = {"cloud": {"points": first}, "kernel": MATERN, "queries": queries}
            fresh.append(client.post("/v1/normals", body))
            return fresh[-1].seconds

        times = alternate(setting.rounds(20), {"again": again, "new": new_queries})
        passes = [bench.ask() for _ in range(setting.rounds(4) + 1)][1:]
        again_after = alternate(setting.rounds(20), {"again": again, "new": new_queries})
    times = {name: Times(spent.seconds + again_after[name].seconds) for name, spent in times.items()}
    evaluation = Figure.of(Times(tuple(figures["pass_hessian"] for figures in passes)))
    evaluate = Times(tuple(answer.stages["evaluate"] for answer in fresh))
    what = f"warm, n = m = {n:,}"
    sums = "reference: the sums of value, gradient and Hessian alone, in the process"
    yield Row(f"{what}: the same request again", Figure.of(times["again"]), evaluation, WARM, sums)
    yield Row(
        f"{what}: new queries, points sent again",
        Figure.of(times["new"]),
        evaluation,
        WARM,
        f"{sums}; last round: {stages(fresh[-1])}",
    )
    yield Row(
        f"{what}: new queries, the `evaluate` stage",
        Figure.of(evaluate),
        evaluation,
        remark="sums, local fits, signs and flags, without the body",
    )


def small_curvatures(setting: Setting, n: int) -> Row:
    """Measures the overhead around the factorization, on a cloud that costs almost nothing to factorize."""
    last: list[Answer] = []
    alone: list[float] = []
    with setting.gramian() as server:
        client = server.client()

        def ask(round_number: int) -> float:
            points = sphere(n, 0.01 * round_number)
            answer = client.post("/v1/curvatures", {"cloud": {"points": points}})
            used = answer.json()["diagnostics"]
            body = {"cloud": {"points": points}, "values": points[:, 2].copy(), "derivatives": 2}
            sums = client.post("/v1/interpolation", {**body, "kernel": used["kernel"], "alpha": used["alpha"]})
            alone.append(answer.stages["gram"] + answer.stages["factor"] + sums.stages["evaluate"])
            last.append(answer)
            return answer.seconds

        times = alternate(setting.rounds(12), {"ours": ask})
    remark = "reference: its factorization, and value, gradient and Hessian at the points; last round: " + stages(last[-1])
    reference = Figure.of(Times(tuple(alone[1:])))
    return Row(f"curvatures, cold, n = m = {n:,}, no kernel given", Figure.of(times["ours"]), reference, SMALL, remark)


def request(n: int, angle: float, kernel: dict[str, Any] | None) -> dict[str, Any]:
    body: dict[str, Any] = {"cloud": {"points": sphere(n, angle)}}
    return body if kernel is None else {**body, "kernel": kernel}


def stages(answer: Answer) -> str:
    """Formats Server-Timing for a remark."""
    return ", ".join(f"{name} {seconds * 1e3:.1f}" for name, seconds in answer.stages.items()) + " ms"
