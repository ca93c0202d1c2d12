"""Rows of the solver `iterative`: one function with a rough kernel through all points."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ..clouds import Floats
from ..setting import Setting
from .data import Cloud, Dragon, torus
from .landmarks import ALPHA, noisy, queries
from .peers import Done, Peers
from .report import OURS, Bound, Entry, Figure, Work
from .service import Answered, Service
from .table import angles, costs, entry, notes, part

MATERN = {"family": "matern", "nu": 1.5, "length_scale": 0.5}
LAPLACE = {"family": "laplace", "epsilon": 0, "length_scale": 0.5}
ITERATIVE = {"solver": "iterative", "alpha": ALPHA}
N_POINTS = 100_000
# : Agreement of the faces at a vertex from which their mean tells the outside.
AGREEMENT = 0.9


@dataclass(frozen=True)
class Goal:
    """Benchmarks of one function through many points."""

    n_points: int
    tolerance: float
    #: Tolerance of the answer that others are compared with.
    converged: float
    bounds: tuple[Bound, ...]


AT_100_000 = Goal(N_POINTS, 1e-8, 1e-11, (*costs(45, 2), Bound("means", "≤", 1e-8)))
BESIDE_FERREUS = Goal(
    N_POINTS, 1e-8, 1e-11, (*costs(45, 2), Bound("over ferreus", "≤", 3), Bound("its error over ours", "≥", 10))
)
AT_A_MILLION = Goal(
    10 * N_POINTS, 1e-6, 1e-7, (Bound("memory", "≤", 3e9), Bound("over ferreus", "≤", 2), Bound("means", "≤", 1e-6))
)


@dataclass(frozen=True)
class Iterative:
    """The tools with which the rows are measured."""

    setting: Setting
    service: Service
    peers: Peers
    dragon: Dragon

    def works(self) -> dict[str, Callable[[], Work]]:
        """Returns the rows by name."""
        return {
            "iterative-dense": self.beside_dense,
            "iterative-growth": self.growth,
            "iterative-matern": lambda: self.many(MATERN, "Matérn 3/2", AT_100_000),
            "iterative-laplace": lambda: self.many(LAPLACE, "Laplace, ε = 0", BESIDE_FERREUS),
            "iterative-laplace-million": lambda: self.many(LAPLACE, "Laplace, ε = 0", AT_A_MILLION),
            "iterative-dragon": self.signature,
        }

    def beside_dense(self) -> Work:
        n = self.setting.size(10_000, 1_000)

        def ours() -> Entry:
            request = {"kernel": MATERN, "alpha": ALPHA}
            found, dense = (self._values(n, {**request, "solver": solver}) for solver in ("iterative", "dense"))
            ratio = {"over dense": Figure(found.seconds / dense.seconds)}
            return entry(OURS, found, {"means": off(found, dense), **said(found), **ratio}, notes(found))

        what = f"mean, Matérn 3/2, ℓ = ½, α = 1e-4, torus, n = m = {n:,}, beside the dense one"
        return Work(what, (Bound("means", "≤", 1e-6),), {}, ours, nobody)

    def growth(self) -> Work:
        few, many = (self.setting.size(n, n // 10) for n in (10_000, N_POINTS))

        def ours() -> Entry:
            request = {"kernel": MATERN, **ITERATIVE}
            small, work = self._values(few, request), self._values(many, request)
            ratio = iterations(work) / iterations(small)
            return entry(OURS, work, {"iterations grow by": Figure(ratio), **said(work)}, notes(work))

        what = f"iterations from n = {few:,} to {many:,}, Matérn 3/2, ℓ = ½, α = 1e-4, torus"
        return Work(what, (Bound("iterations grow by", "≤", 2),), {}, ours, nobody)

    def many(self, kernel: Mapping[str, Any], name: str, goal: Goal) -> Work:
        n, request = self.setting.size(goal.n_points, 2_000), {"kernel": kernel, **ITERATIVE}

        @cache
        def inputs() -> dict[str, Floats]:
            points = torus(n).points
            return {"points": points, "values": noisy(points), "queries": queries(self._n_queries)}

        @cache
        def theirs() -> Done:
            length = kernel["length_scale"]
            return self.peers.python("ferreus", inputs(), length_scale=length, nugget=ALPHA, tolerance=1e-6)

        @cache
        def converged() -> Answered:
            return self._values(n, {**request, "tolerance": goal.converged})

        def ours() -> Entry:
            work = self._values(n, {**request, "tolerance": goal.tolerance})
            figures = {"means": off(work, converged()), **said(work), "over ferreus": Figure(work.seconds / theirs().seconds)}
            # Only Laplace without ε is its exponential.
            if kernel is LAPLACE:
                figures["its error over ours"] = Figure(off(theirs(), converged()).value / figures["means"].value)
            return entry(OURS, work, figures, notes(work))

        def others() -> Iterable[Entry]:
            figures = {"means": off(theirs(), converged())} if kernel is LAPLACE else {}
            yield entry("ferreus_rbf, exponential, tolerance 1e-6", theirs(), figures)
            work = self.peers.python("interpolation", inputs(), n_neighbours=64)
            yield entry("SciPy, 64 neighbours, a thin plate spline", work, {})

        what = f"mean, {name}, ℓ = ½, α = 1e-4, torus, n = {n:,}, m = {self._n_queries:,}, tolerance {goal.tolerance:g}"
        return Work(what, goal.bounds, {}, ours, others)

    def signature(self) -> Work:
        scan = self.dragon.scan(2)
        cloud = part(self.setting, scan)
        agreeing = part(
            self.setting, Cloud(scan.points, np.where(self.dragon.agreement(2)[:, None] < AGREEMENT, 0, scan.normals))
        )

        def ours() -> Entry:
            request = {"solver": "iterative", "surface_model": "auto"}
            work = self.service.ask("/v1/normals", cloud.points, request)
            figures = {**angles(work, cloud, is_signed=True), **said(work)}
            figures["flipped"] = angles(work, agreeing, is_signed=True)["flipped"]
            return entry(OURS, work, figures, f"flipped where faces agree; {notes(work)}")

        bounds = (*costs(60, 2), Bound("median", "≤", 1.6), Bound("flipped", "≤", 0.05))
        what = f"dragon 2, {len(cloud.points):,} points: normals of the signature function, by the rule for normals"
        return Work(what, bounds, {"median": "°", "95 %": "°", "flipped": "%"}, ours, nobody)

    @property
    def _n_queries(self) -> int:
        return self.setting.size(10_000, 500)

    def _values(self, n: int, request: Mapping[str, Any]) -> Answered:
        points = torus(n).points
        tensors = {"values": noisy(points), "queries": queries(self._n_queries)}
        return self.service.ask("/v1/interpolation", points, request, tensors)


def nobody() -> Iterable[Entry]:
    """No peer is measured."""
    return ()


def off(found: Done, expected: Answered) -> Figure:
    """The largest difference of values, over the largest value."""
    values: Floats = expected.arrays["values"].ravel()
    own = found.arrays["values" if "values" in found.arrays else "means"].ravel()
    return Figure(float(np.abs(own - values).max() / np.abs(values).max()))


def iterations(work: Answered) -> int:
    return int(work.members["diagnostics"]["iterations"])


def said(work: Answered) -> dict[str, Figure]:
    """Diagnostics of the answer."""
    residual = work.members["diagnostics"]["relative_residual"]
    return {"residual": Figure(residual), "iterations": Figure(iterations(work))}
