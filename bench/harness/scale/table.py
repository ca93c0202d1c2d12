"""Rows of the table: the request to gramian, the judgement of its answer, and peers for the same work."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from ..clouds import Floats, cube, sphere, wave
from ..setting import Setting
from . import accuracy
from .data import Cloud, Dragon, torus
from .peers import Done, Peers
from .report import OURS, Bound, Entry, Figure, Work
from .service import Answered, Service

#: Noise of 0.1 % of the outer radius of the torus, 2.5. It is 0.4 spacings, where a spacing is the side of a
#: square with the area per point when there are a million.
NOISE = 2.5e-3
N_TORUS = 1_000_000
N_CUBE = 1_000_000
N_QUERIES = 100_000
#: Number of points at which the dense posterior runs as well.
N_DENSE = 8_000
MATERN = {"family": "matern", "nu": 1.5, "length_scale": 0.3}
#: Noise variance of the values: their noise is 1 % of the standard deviation of the prior.
ALPHA = 1e-4
#: Number of rounds for work that takes milliseconds.
N_ROUNDS = 9

DEVIATIONS = {"include": ["std"]}
ANGLES = {"median": "°", "95 %": "°", "flipped": "%"}
CURVATURES = {"median": "%", "95 %": "%", "unflagged": "%", "bands cover": "%"}


@dataclass(frozen=True)
class Table:
    """The tools and data with which the rows are measured."""

    setting: Setting
    service: Service
    peers: Peers
    dragon: Dragon

    def works(self) -> dict[str, Callable[[], Work]]:
        """Returns the rows by name. A row makes its cloud only when it is called."""
        # What jets of degree 4 reach.
        exact = (Bound("median", "≤", 1e-5), Bound("95 %", "≤", 6e-5), Bound("bands cover", "≥", 90))
        noisy = (Bound("median", "≤", 15), Bound("bands cover", "≥", 90), Bound("bands cover", "≤", 99.5))
        return {
            "dragon2-normals": lambda: self.scan_normals(2, costs(6, 0.5), (1.7, 8, 0.25)),
            "dragon2-curvatures": self.scan_curvatures,
            "dragon1-thinned": self.thinned_curvatures,
            "dragon1-normals": lambda: self.scan_normals(1, costs(25, 1.5), (1.5, 6.5, 0.35)),
            "torus": lambda: self.torus(0, (*costs(12, 3), *exact)),
            "noisy-torus": lambda: self.torus(NOISE, (*costs(150, 3), *noisy)),
            "posterior": self.posterior,
            "laplacian": self.laplacian,
            "small-normals": self.small_normals,
        }

    def scan_normals(self, level: int, cost: tuple[Bound, ...], limits: tuple[float, float, float]) -> Work:
        cloud = self._part(self.dragon.scan(level))

        def ours() -> Entry:
            work = self.service.ask("/v1/normals", cloud.points, {})
            return entry(OURS, work, angles(work, cloud, is_signed=True), notes(work))

        def others() -> Iterable[Entry]:
            for n_neighbours in (12, 30):
                work = self.peers.python("open3d", {"points": cloud.points}, n_neighbours=n_neighbours, is_oriented=1)
                yield entry(f"Open3D, {n_neighbours} neighbours", work, angles(work, cloud))
            work = self.peers.cgal("oriented", cloud.points, 12, 2)
            yield entry("CGAL jets, degree 2, 12 neighbours", work, angles(work, cloud))
            work = self.peers.python("quadrics", {"points": cloud.points}, n_neighbours=18, is_oriented=1)
            yield entry("NumPy quadrics, 18 neighbours", work, angles(work, cloud))

        bounds = tuple(Bound(name, "≤", limit) for name, limit in zip(ANGLES, limits, strict=True))
        return Work(f"dragon {level}, {len(cloud.points):,} points: normals", (*cost, *bounds), ANGLES, ours, others)

    def scan_curvatures(self) -> Work:
        scan = self._part(self.dragon.scan(2))
        known = np.linalg.norm(scan.normals, axis=1, keepdims=True) > 0
        curvatures = np.where(known, self.dragon.curved(scan.points, scan.normals), np.nan)
        cloud = Cloud(scan.points, scan.normals, curvatures)

        def ours() -> Entry:
            work = self.service.ask("/v1/curvatures", cloud.points, DEVIATIONS)
            share = 100 * (1 - n_flagged(work) / len(cloud.points))
            return entry(OURS, work, {"unflagged": Figure(share, "%"), **curved(work, cloud), **bands(work, cloud)}, notes(work))

        return Work(
            f"dragon 2, {len(cloud.points):,} points: curvatures with deviations",
            (*costs(12, 1), Bound("unflagged", "≥", 50)),
            CURVATURES,
            ours,
            lambda: self._curvature_peers(cloud, [(2, 12), (2, 18), (4, 30)]),
        )

    def thinned_curvatures(self) -> Work:
        cloud = self.dragon.thinned(self.setting.size(20_000, 2_000))

        def ours() -> Entry:
            work = self.service.ask("/v1/curvatures", cloud.points, DEVIATIONS)
            return entry(OURS, work, {**curved(work, cloud), **bands(work, cloud)}, notes(work))

        return Work(
            f"dragon 1 thinned to {len(cloud.points):,} points: curvatures, against jets on the dense cloud",
            (*costs(4, 0.3), Bound("median", "≤", 18), Bound("bands cover", "≥", 85)),
            CURVATURES,
            ours,
            lambda: self._curvature_peers(cloud, [(2, 8), (2, 18), (4, 30)]),
        )

    def torus(self, noise: float, bounds: tuple[Bound, ...]) -> Work:
        n = self.setting.size(N_TORUS, 2_000)
        # A quick run has fewer points: the noise keeps its ratio to their spacing.
        cloud = torus(n, noise * np.sqrt(N_TORUS / n))

        def ours() -> Entry:
            work = self.service.ask("/v1/curvatures", cloud.points, DEVIATIONS)
            figures = {**curved(work, cloud), **bands(work, cloud)}
            return entry(OURS, work, {**figures, **normals_of(work, cloud, is_signed=True)}, notes(work))

        of_noise = ", noise of 0.1 % (0.4 spacings)" if noise else ""
        fits = [(2, 200), (2, 400)] if noise else [(2, 18), (4, 30)]
        what = f"random torus (2, 1/2), {n:,} points{of_noise}: curvatures with deviations"
        return Work(what, bounds, CURVATURES, ours, lambda: self._curvature_peers(cloud, fits))

    def _curvature_peers(self, cloud: Cloud, fits: list[tuple[int, int]]) -> Iterable[Entry]:
        """Yields CGAL for each (degree, neighbours), and NumPy for the last pair of degree 2."""
        for degree, n_neighbours in fits:
            work = self.peers.cgal("curvatures", cloud.points, n_neighbours, degree)
            figures = {**curved(work, cloud), **normals_of(work, cloud)}
            yield entry(f"CGAL jets, degree {degree}, {n_neighbours} neighbours", work, figures)
        n_neighbours = [k for degree, k in fits if degree == 2][-1]
        if n_neighbours <= 30:
            work = self.peers.python("quadrics", {"points": cloud.points}, n_neighbours=n_neighbours, is_oriented=0)
            figures = {**curved(work, cloud), **normals_of(work, cloud)}
            yield entry(f"NumPy quadrics, {n_neighbours} neighbours", work, figures)

    def posterior(self) -> Work:
        n, n_queries, n_dense = (self.setting.size(*sizes) for sizes in ((N_CUBE, 4_000), (N_QUERIES, 500), (N_DENSE, 1_000)))
        request = {"kernel": MATERN, "alpha": ALPHA, "include": ["variances"]}
        points, queries = cube(n, 0), cube(n_queries, 1)
        values = wave(points) + np.sqrt(ALPHA) * np.random.default_rng(2).standard_normal(n)

        def error(means: Floats) -> dict[str, Figure]:
            return {"rms error": Figure(rms(means - wave(queries)))}

        def ours() -> Entry:
            work = self.service.ask("/v1/posterior", points, request, {"values": values, "queries": queries})
            covered = accuracy.coverage(work.arrays["means"], np.sqrt(work.arrays["variances"]), wave(queries))
            figures = {**self._beside_dense(n_dense, request), **error(work.arrays["means"]), "bands cover": Figure(covered, "%")}
            return entry(OURS, work, figures, f"the first two at n = {n_dense:,}; {notes(work)}")

        def others() -> Iterable[Entry]:
            arrays = {"points": points, "values": values, "queries": queries}
            work = self.peers.python("interpolation", arrays, n_neighbours=64)
            yield entry("SciPy RBFInterpolator, 64 neighbours", work, error(work.arrays["means"]), "means alone")

        return Work(
            f"posterior mean and variance, {n:,} points in the cube, {n_queries:,} queries, Matérn 3/2",
            (*costs(60, 2), Bound("means off", "≤", 5), Bound("deviations off", "≤", 5)),
            {"means off": "%", "deviations off": "%"},
            ours,
            others,
        )

    def _beside_dense(self, n: int, request: Mapping[str, Any]) -> dict[str, Figure]:
        """Compares the local with the dense posterior on n points, with values drawn from the prior.

        Figures are root mean squares in percent of the dense standard deviation.
        """
        points, queries = cube(n, 3), cube(1_000, 4)
        values = draw(points, 5) + np.sqrt(ALPHA) * np.random.default_rng(6).standard_normal(n)
        tensors = {"values": values, "queries": queries}
        local, dense = (
            self.service.ask("/v1/posterior", points, {**request, "solver": solver}, tensors).arrays
            for solver in ("local", "dense")
        )
        deviations = np.sqrt(dense["variances"])
        means = (local["means"] - dense["means"]) / deviations
        widths = np.sqrt(local["variances"]) / deviations - 1
        return {"means off": Figure(100 * rms(means), "%"), "deviations off": Figure(100 * rms(widths), "%")}

    def laplacian(self) -> Work:
        points = sphere(self.setting.size(100_000, 2_000))
        values, exact = zonal(points)

        def error(found: Floats) -> dict[str, Figure]:
            return {"relative error": Figure(float(np.linalg.norm(found - exact) / np.linalg.norm(exact)))}

        def ours() -> Entry:
            work = self.service.ask("/v1/laplace-beltrami/sparse-matrix", points, {})
            rows, columns = (int(k) for k in np.ravel(work.member("shape")))
            indices, indptr = (np.asarray(work.member(name)).astype(np.int64) for name in ("indices", "indptr"))
            matrix = csr_matrix((np.ravel(work.member("data")), indices, indptr), shape=(rows, columns))
            return entry(OURS, work, error(matrix @ values), f"{matrix.nnz / rows:.0f} entries a row; {notes(work)}")

        def others() -> Iterable[Entry]:
            energy = -4 * np.pi * float(np.mean(values * exact))
            for n_neighbours in (30, 60):
                work = self.peers.python("laplacian", {"points": points, "values": values}, n_neighbours=n_neighbours)
                off = percent(abs(float(work.arrays["energy"]) / energy - 1))
                figures = {**error(work.arrays["values"]), "energy off": off}
                yield entry(f"robust_laplacian, {n_neighbours} neighbours", work, figures, "meant weakly, not at points")

        return Work(
            f"sparse Laplace–Beltrami, sphere, n = {len(points):,}, of sin(π(1 + 2 x₃))",
            (*costs(20, 1), Bound("relative error", "≤", 1e-2)),
            {},
            ours,
            others,
        )

    def small_normals(self) -> Work:
        cloud = torus(self.setting.size(4_000, 1_000))

        def ours() -> Entry:
            n_rounds = self.setting.rounds(N_ROUNDS)
            work = self.service.ask("/v1/normals", cloud.points, {"solver": "local"}, n_rounds=n_rounds)
            return entry(OURS, work, angles(work, cloud, is_signed=True), f"best of {n_rounds}; {notes(work)}")

        def others() -> Iterable[Entry]:
            for degree, n_neighbours in ((2, 12), (2, 18), (4, 30)):
                # Bounds apply only to peers that answer the same. Without signs half of the normals point
                # inward.
                for what, who in (("oriented", "CGAL"), ("normals", "without signs: CGAL")):
                    work = self.peers.cgal(what, cloud.points, n_neighbours, degree, rounds=N_ROUNDS)
                    yield entry(f"{who} jets, degree {degree}, {n_neighbours} neighbours", work, angles(work, cloud))
            work = self.peers.python("open3d", {"points": cloud.points}, n_neighbours=12, is_oriented=1)
            yield entry("Open3D, 12 neighbours", work, angles(work, cloud))
            work = self.peers.python("quadrics", {"points": cloud.points}, n_neighbours=18, is_oriented=1)
            yield entry("NumPy quadrics, 18 neighbours", work, angles(work, cloud))

        return Work(
            f"random torus (2, 1/2), {len(cloud.points):,} points: normals, solver local",
            (Bound("time", "≤", 0.06), *(Bound(name, "<", "CGAL") for name in ("time", "median", "95 %"))),
            ANGLES,
            ours,
            others,
        )

    def _part(self, cloud: Cloud) -> Cloud:
        return part(self.setting, cloud)


def part(setting: Setting, cloud: Cloud) -> Cloud:
    """Returns every point, or about 2,000 of them in a quick run."""
    kept = slice(None, None, max(1, len(cloud.points) // 2_000) if setting.is_quick else 1)
    return Cloud(cloud.points[kept], cloud.normals[kept])


def costs(seconds: float, gigabytes: float) -> tuple[Bound, Bound]:
    return Bound("time", "≤", seconds), Bound("memory", "≤", 1e9 * gigabytes)


def entry(who: str, work: Done, figures: Mapping[str, Figure], remark: str = "") -> Entry:
    return Entry(who, {"time": Figure(work.seconds, "s"), "memory": Figure(work.peak_bytes, "B"), **figures}, remark)


def angles(work: Done, cloud: Cloud, is_signed: bool = False) -> dict[str, Figure]:
    """Returns errors of the normals as lines. Without `is_signed`, the overall sign is left open."""
    found = accuracy.angles(work.arrays["normals"], cloud.normals, is_signed)
    figures = (found.median, found.high, found.flipped)
    return {name: Figure(figure, unit) for (name, unit), figure in zip(ANGLES.items(), figures, strict=True)}


def normals_of(work: Done, cloud: Cloud, is_signed: bool = False) -> dict[str, Figure]:
    """Returns errors of the normals in an answer with curvatures. Peers give no signs there."""
    found = accuracy.angles(work.arrays["normals"], cloud.normals, is_signed)
    figures = {"normals": Figure(found.median, "°")}
    return {**figures, "flipped": Figure(found.flipped, "%")} if is_signed else figures


def curved(work: Done, cloud: Cloud) -> dict[str, Figure]:
    """Returns errors of the mean curvature, and the median error of the worse principal curvature."""
    found, exact, _ = _curvatures(work, cloud)
    median, high = np.quantile(accuracy.mean_errors(found, exact), [0.5, 0.95], method="higher")
    principal = np.quantile(accuracy.principal_errors(found, exact), 0.5, method="higher")
    return {"median": percent(median), "95 %": percent(high), "principal": percent(principal)}


def bands(work: Done, cloud: Cloud) -> dict[str, Figure]:
    """Returns the percentage of error bands of the mean curvature that contain the truth."""
    found, exact, known = _curvatures(work, cloud)
    deviations = work.arrays["mean_curvature_std"][known]
    return {"bands cover": Figure(accuracy.coverage(found.mean(axis=1), deviations, exact.mean(axis=1)), "%")}


def _curvatures(work: Done, cloud: Cloud) -> tuple[Floats, Floats, Floats]:
    """Returns principal curvatures, the true ones for the outer side, and a mask of known points."""
    assert cloud.curvatures is not None
    known = np.isfinite(cloud.curvatures).all(axis=1)
    if "principal_curvatures" in work.arrays:
        found = work.arrays["principal_curvatures"][known]
    else:
        found = accuracy.outward(work.arrays["normals"][known], work.arrays["curvatures"][known], cloud.normals[known])
    return found, cloud.curvatures[known], known


def percent(share: float) -> Figure:
    return Figure(100 * float(share), "%")


def n_flagged(work: Answered) -> int:
    return len({item["query"] for item in work.members.get("flags", [])})


def notes(work: Answered) -> str:
    """Formats diagnostics of the answer: solver, kernel, flagged queries, warnings."""
    diagnostics = work.members.get("diagnostics", {})
    words = [f"solver {diagnostics.get('solver')}"]
    if kernel := diagnostics.get("kernel"):
        words.append(" ".join(str(value if isinstance(value, str) else f"{value:.3g}") for value in kernel.values()))
    if n := n_flagged(work):
        words.append(f"{n:,} flagged")
    return ", ".join(words + sorted({warning["code"] for warning in diagnostics.get("warnings", [])}))


def zonal(points: Floats) -> tuple[Floats, Floats]:
    """Evaluates f = sin(π(1 + 2z)) on the unit sphere, and its Laplace–Beltrami (1 − z²)f″ − 2z f′."""
    z = points[:, 2]
    phase = np.pi * (1 + 2 * z)
    first, second = 2 * np.pi * np.cos(phase), -4 * np.pi**2 * np.sin(phase)
    return np.sin(phase), (1 - z * z) * second - 2 * z * first


def draw(points: Floats, seed: int) -> Floats:
    """Draws a function from the prior of `MATERN`, at the given points."""
    squares = np.sum(points**2, axis=1)
    distances = np.sqrt(np.maximum(squares[:, None] + squares[None, :] - 2 * points @ points.T, 0))
    s = np.sqrt(3) * distances / float(MATERN["length_scale"])
    gram = (1 + s) * np.exp(-s)
    gram[np.diag_indices(len(points))] = 1 + 1e-9
    return np.linalg.cholesky(gram) @ np.random.default_rng(seed).standard_normal(len(points))


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
