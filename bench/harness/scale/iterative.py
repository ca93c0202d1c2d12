"""Rows of the solver `iterative`: one function with a rough kernel through all points."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..clouds import Floats
from ..setting import Setting
from .data import Cloud, Dragon, torus
from .landmarks import ALPHA, noisy, queries
from .peers import Peers
from .report import OURS, Bound, Entry, Figure, Work
from .service import Answered, Service
from .table import angles, costs, entry, notes, part

MATERN = {"family": "matern", "nu": 1.5, "length_scale": 0.5}
LAPLACE = {"family": "laplace", "epsilon": 0, "length_scale": 0.5}
ITERATIVE = {"solver": "iterative", "alpha": ALPHA}
#: Tolerance of the answers that others are compared with.
CONVERGED = {"tolerance": 1e-11}
N_POINTS = 100_000
#: Agreement of the faces at a vertex from which their mean says which side is outside.
AGREEMENT = 0.9


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
            "iterative-matern": lambda: self.many(MATERN, "Matérn 3/2", (*costs(45, 2), Bound("means", "≤", 1e-8))),
            "iterative-laplace": lambda: self.many(LAPLACE, "Laplace, ε = 0", costs(45, 2)),
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

    def many(self, kernel: Mapping[str, Any], name: str, bounds: tuple[Bound, ...]) -> Work:
        n, request = self.setting.size(N_POINTS, 2_000), {"kernel": kernel, **ITERATIVE}
        converged: list[Answered] = []

        def ours() -> Entry:
            work = self._values(n, request)
            converged.append(self._values(n, {**request, **CONVERGED}))
            return entry(OURS, work, {"means": off(work, converged[0]), **said(work)}, notes(work))

        def others() -> Iterable[Entry]:
            points, at = torus(n).points, queries(self._n_queries)
            inputs = {"points": points, "values": noisy(points), "queries": at}
            length = kernel["length_scale"]
            work = self.peers.python("ferreus", inputs, length_scale=length, nugget=ALPHA, tolerance=1e-6)
            figures = {}
            if kernel is LAPLACE and converged:
                expected = converged[0].arrays["values"].ravel()
                found = work.arrays["means"].ravel()
                figures = {"means": Figure(float(np.abs(found - expected).max() / np.abs(expected).max()))}
            yield entry("ferreus_rbf, exponential, tolerance 1e-6", work, figures)
            work = self.peers.python("interpolation", inputs, n_neighbours=64)
            yield entry("SciPy, 64 neighbours, a thin plate spline", work, {})

        what = f"mean, {name}, ℓ = ½, α = 1e-4, torus, n = {n:,}, m = {self._n_queries:,}"
        return Work(what, bounds, {}, ours, others)

    def signature(self) -> Work:
        scan = self.dragon.scan(2)
        cloud = part(self.setting, scan)
        agreeing = part(
            self.setting, Cloud(scan.points, np.where(self.dragon.agreement(2)[:, None] < AGREEMENT, 0, scan.normals))
        )

        def ours() -> Entry:
            request = {"solver": "iterative", "surface": "signature"}
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


def off(found: Answered, expected: Answered) -> Figure:
    """The largest difference of values, over the largest value."""
    values: Floats = expected.arrays["values"]
    return Figure(float(np.abs(found.arrays["values"] - values).max() / np.abs(values).max()))


def iterations(work: Answered) -> int:
    return int(work.members["diagnostics"]["iterations"])


def said(work: Answered) -> dict[str, Figure]:
    """What the answer says of itself."""
    residual = work.members["diagnostics"]["relative_residual"]
    return {"residual": Figure(residual), "iterations": Figure(iterations(work))}
