"""Rows of the solver `landmark`: one function through all points, beside the dense solver where that runs."""

import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..clouds import Floats
from ..setting import Setting
from .data import torus
from .peers import Done, Peers
from .report import OURS, Bound, Entry, Figure, Work
from .service import Answered, Service
from .table import costs, entry, notes

GAUSS = {"family": "gauss", "length_scale": 1.0}
#: Noise variance of the values, and that of surfaces, which are exact.
ALPHA = 1e-4
SURFACE_ALPHA = 1e-10
#: Rounds of a row that takes milliseconds, on both sides: others on the machine disturb most of them.
N_ROUNDS = 15


@dataclass(frozen=True)
class Landmarks:
    """The tools with which the rows are measured."""

    setting: Setting
    service: Service
    peers: Peers

    def works(self) -> dict[str, Callable[[], Work]]:
        """Returns the rows by name."""
        return {
            "landmark-small": self.small,
            "landmark-dense": self.beside_dense,
            "landmark-torus": lambda: self.surface(100_000, costs(8, 0.5)),
            "landmark-torus-million": lambda: self.surface(1_000_000, costs(60, 1)),
            "landmark-posterior": self.posterior,
        }

    def small(self) -> Work:
        """A posterior of 2,000 points by at most 350 landmarks, beside scikit-learn's."""
        kernel, request = {**GAUSS, "length_scale": 1.75}, {"include": ["variances"], "alpha": 1e-2}
        n, m = self.setting.size(2_000, 500), self.setting.size(1_000, 100)

        def theirs() -> Done:
            fixed = {"length_scale": kernel["length_scale"], "alpha": request["alpha"]}
            return self.peers.python("process", inputs(n, m), N_ROUNDS, **fixed)

        def others() -> Iterable[Entry]:
            yield entry("scikit-learn", theirs(), {})
            yield from self._gpytorch("gpytorch", inputs(n, m), {**request, "kernel": kernel})

        def ours() -> Entry:
            found, dense = (
                self._posterior(n, m, {**request, "kernel": kernel, "solver": s}, N_ROUNDS) for s in ("landmark", "dense")
            )
            ratios = {
                "times faster": Figure(theirs().seconds / found.seconds),
                "over dense": Figure(found.seconds / dense.seconds),
            }
            return entry(OURS, found, {**off(found, dense), **ratios}, notes_of(found))

        what = f"posterior mean and variance, Gauss ℓ = 1.75, α = 0.01, torus, n = {n:,}, m = {m:,}, beside scikit-learn"
        bounds = (Bound("times faster", "≥", 8), *accurate(1e-9, 1e-5), Bound("rank", "≤", 350))
        return Work(what, bounds, {}, ours, others)

    def beside_dense(self) -> Work:
        request = {"kernel": GAUSS, "alpha": ALPHA}
        n, m = self.setting.size(20_000, 2_000), self.setting.size(10_000, 500)

        def ours() -> Entry:
            found, dense = (self._values(n, {**request, "solver": solver}) for solver in ("landmark", "dense"))
            faster = {"times faster": Figure(dense.seconds / found.seconds)}
            return entry(OURS, found, {**off(found, dense), **faster}, notes_of(found))

        bounds = (Bound("times faster", "≥", 15), *accurate(1e-9)[:1], Bound("residual", "≤", 1e-10))
        what = "mean, Gauss ℓ = 1, α = 1e-4, torus, n = 20,000, m = 10,000, beside the dense one"
        return Work(what, bounds, {}, ours, lambda: self._gpytorch("gpytorch_mean", inputs(n, m), request))

    def surface(self, n_points: int, cost: tuple[Bound, ...]) -> Work:
        n = self.setting.size(n_points, 2_000)
        request = {"kernel": GAUSS, "alpha": SURFACE_ALPHA, "solver": "landmark", "surface_model": "signature"}

        def ours() -> Entry:
            cloud = torus(n)
            work = self.service.ask("/v1/curvatures", cloud.points, request)
            found = np.sort(work.arrays["principal_curvatures"], axis=1)
            exact = np.sort(cloud.curvatures, axis=1)
            worst = np.abs(found - exact).max() / np.abs(exact).max()
            return entry(OURS, work, {"curvatures": Figure(float(worst)), **said(work)}, notes_of(work))

        what = f"normals and curvatures, Gauss ℓ = 1, α = 1e-10, torus (2, 1/2), n = m = {n:,}"
        return Work(what, (*cost, Bound("curvatures", "≤", 5e-9)), {}, ours, nobody)

    def posterior(self) -> Work:
        n, m = self.setting.size(1_000_000, 4_000), self.setting.size(10_000, 500)
        request = {"kernel": GAUSS, "alpha": ALPHA, "include": ["variances"], "solver": "landmark"}

        def ours() -> Entry:
            checked = [self.setting.size(size, 1_000) for size in (4_000, 20_000)]
            worst = functools.reduce(larger, (self._beside_dense(size, request) for size in checked))
            work = self._posterior(n, m, request)
            misses = work.arrays["means"].ravel() - wave(queries(m))
            error = {"rms error": Figure(float(np.sqrt(np.mean(misses**2))))}
            sizes = " and ".join(f"{size:,}" for size in checked)
            return entry(OURS, work, {**worst, **error, **said(work)}, f"the first two at n = {sizes}; {notes_of(work)}")

        what = f"posterior mean and variance, Gauss ℓ = 1, α = 1e-4, torus, n = {n:,}, m = {m:,}"
        return Work(what, (*costs(45, 1.5), *accurate(1e-6, 1e-6)), {}, ours, nobody)

    def _gpytorch(self, method: str, data: dict[str, Floats], request: Mapping[str, Any]) -> Iterable[Entry]:
        """GPyTorch where it is requested, with the largest error of its means over the largest mean."""
        if not self.setting.with_gpytorch:
            return
        found = self.peers.python(method, data, length_scale=request["kernel"]["length_scale"], alpha=request["alpha"])
        dense = self._posterior(len(data["values"]), len(data["queries"]), {**request, "solver": "dense"})
        yield entry(
            {"gpytorch": "GPyTorch, exact", "gpytorch_mean": "GPyTorch, as it comes"}[method],
            found,
            {"means": apart(found, dense)},
        )

    def _beside_dense(self, n: int, request: Mapping[str, Any]) -> dict[str, Figure]:
        found, dense = (self._posterior(n, 1_000, {**request, "solver": s}) for s in ("landmark", "dense"))
        return off(found, dense)

    def _posterior(self, n: int, m: int, request: Mapping[str, Any], n_rounds: int = 1) -> Answered:
        points = torus(n).points
        return self.service.ask("/v1/posterior", points, request, {"values": noisy(points), "queries": queries(m)}, n_rounds)

    def _values(self, n: int, request: Mapping[str, Any]) -> Answered:
        points, m = torus(n).points, self.setting.size(10_000, 500)
        return self.service.ask("/v1/interpolation", points, request, {"values": noisy(points), "queries": queries(m)})


def larger(some: Mapping[str, Figure], others: Mapping[str, Figure]) -> dict[str, Figure]:
    """The larger of each two figures."""
    return {name: max(some[name], others[name], key=lambda figure: figure.value) for name in some}


def nobody() -> Iterable[Entry]:
    """No peer is measured."""
    return ()


def accurate(mean: float, variance: float = np.inf) -> tuple[Bound, Bound]:
    return Bound("means", "≤", mean), Bound("variances", "≤", variance)


def queries(m: int) -> Floats:
    return torus(m, seed=1).points


def wave(points: Floats) -> Floats:
    return np.sin(2 * points[:, 0]) + points[:, 1] * points[:, 2]


def noisy(points: Floats) -> Floats:
    return wave(points) + np.sqrt(ALPHA) * np.random.default_rng(2).standard_normal(len(points))


def inputs(n: int, m: int) -> dict[str, Floats]:
    """What a peer is given."""
    points = torus(n).points
    return {"points": points, "values": noisy(points), "queries": queries(m)}


def apart(found: Answered | Done, expected: Answered | Done) -> Figure:
    """The largest difference of means over the largest mean."""
    name = "means" if "means" in expected.arrays else "values"
    means = expected.arrays[name]
    return Figure(float(np.abs(found.arrays[name] - means).max() / np.abs(means).max()))


def off(found: Answered, expected: Answered) -> dict[str, Figure]:
    """Largest differences: of means over the largest mean, of variances relative."""
    figures = {"means": apart(found, expected), **said(found)}
    if "variances" in expected.arrays:
        figures["variances"] = Figure(float(np.abs(found.arrays["variances"] / expected.arrays["variances"] - 1).max()))
    return figures


def said(work: Answered) -> dict[str, Figure]:
    """Diagnostics of the answer."""
    diagnostics = work.members["diagnostics"]
    return {"residual": Figure(diagnostics["relative_residual"]), "rank": Figure(diagnostics["rank"])}


def notes_of(work: Answered) -> str:
    diagnostics = work.members["diagnostics"]
    return f"{notes(work)}; {diagnostics['remaining_diagonal']:.1e} remain, {diagnostics['tolerance']:.1e} may"
