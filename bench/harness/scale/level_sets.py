"""Rows of meshes: the request to gramian, what holds of its mesh, and peers that mesh the same points."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..clouds import Floats, sphere
from ..clouds import torus as thick_torus
from ..setting import Setting
from . import accuracy
from .data import Dragon, bunny, of_mesh, torus
from .peers import Done, Peers
from .report import OURS, Bound, Entry, Figure, Work
from .service import Answered, NotServed, Service
from .topology import Mesh, angles, distances, topology

PATH = "/v1/level-set"
DISTANCES = {"mean": "h", "99 %": "h", "largest": "h"}
GAUSS = {"family": "gauss", "length_scale": 0.5}
GAUSS_ALPHA = 1e-12
PEERS = (("poisson", "screened Poisson (PyMeshLab), depth 9", 9), ("apss", "APSS (PyMeshLab), grid of 200", 200))

Bodies = Mapping[str, tuple[Floats, Sequence[int]]]


@dataclass(frozen=True)
class LevelSets:
    """The tools and data with which the rows are measured."""

    setting: Setting
    service: Service
    peers: Peers
    dragon: Dragon

    def works(self) -> dict[str, Callable[[], Work]]:
        """Returns the rows by name."""
        return {
            "mesh-torus": self.gauss_torus,
            "mesh-bodies": self.bodies,
            "mesh-bunny": self.bunny,
            "mesh-dragon3": lambda: self.scan(3, {}, (*parts(2, -4), *nearness(0.04, 0.22, 2))),
            "mesh-dragon2": lambda: self.scan(2, {"step": 1.5}, (*costs(12, 1), *parts(1, -6), *nearness(0.05, 0.3, np.inf)[:2])),
            "mesh-million": self.million,
            "mesh-noise": self.noise,
        }

    def gauss_torus(self) -> Work:
        points, _, _ = thick_torus(self.setting.size(1_000, 400))
        fit = {"kernel": GAUSS, "alpha": GAUSS_ALPHA}

        def ours() -> Entry:
            step = 0.04 if not self.setting.is_quick else 0.05
            work = self.service.ask(PATH, points, {**fit, "quality": "raw", "step": step})
            mesh = mesh_of(work)
            ones = {"values": np.ones(len(points)), "queries": np.concatenate([points, mesh.vertices])}
            values = self.service.ask("/v1/interpolation", points, {**fit, "mean": "zero"}, ones).arrays["values"].ravel()
            level = values[: len(points)].mean()
            figures = {
                "triangles": Figure(len(mesh.cells)),
                "off the level": Figure(float(np.abs(values[len(points) :] - level).max())),
                **topology_of(mesh),
                "off the torus": Figure(float(off_torus(mesh.vertices, 1.0, 0.4).max())),
            }
            time = {"time": Figure(work.stages["evaluate"], "s"), "memory": Figure(work.peak_bytes, "B")}
            return Entry(OURS, {**time, **figures}, "time after the factor")

        bounds = (
            Bound("time", "≤", 1.5),
            Bound("triangles", "≥", 100_000),
            Bound("off the level", "≤", 1e-8),
            *characteristic(0, 0),
            Bound("off the torus", "≤", 1e-7),
        )
        return Work(f"torus (1, 0.4), {len(points):,} points, Gauss: raw triangles", bounds, {}, ours, tuple)

    def bodies(self) -> Work:
        """Closed bodies, each alone. Figures are the worst of all."""
        n = self.setting.size(2_000, 800)

        def ours() -> Entry:
            worst = {"wrong topology": 0, "open": 0, "smallest angle": np.inf, "below 30°": 0.0}
            seconds, peak = 0.0, 0
            for points, expected in bodies(n).values():
                work = self.service.ask(PATH, points, {})
                found, mesh = topology(mesh_of(work)), mesh_of(work)
                degrees = angles(mesh)
                worst["wrong topology"] += sorted(found.characteristics) != sorted(expected)
                worst["open"] += not found.is_closed
                worst["smallest angle"] = min(worst["smallest angle"], float(degrees.min()))
                worst["below 30°"] = max(worst["below 30°"], 100 * float((degrees < 30).mean()))
                seconds, peak = max(seconds, work.seconds), max(peak, work.peak_bytes)
            units = {"smallest angle": "°", "below 30°": "%"}
            figures = {name: Figure(value, units.get(name, "")) for name, value in worst.items()}
            costs = {"time": Figure(seconds, "s"), "memory": Figure(peak, "B")}
            return Entry(OURS, {**costs, **figures}, ", ".join(bodies(n)))

        bounds = (
            Bound("wrong topology", "≤", 0),
            Bound("open", "≤", 0),
            Bound("smallest angle", "≥", 15),
            Bound("below 30°", "≤", 1),
        )
        return Work(f"bodies of {n:,} points, nothing chosen", bounds, {"smallest angle": "°", "below 30°": "%"}, ours, tuple)

    def bunny(self) -> Work:
        original = Mesh(*bunny(self.dragon.folder))
        return self._beside_original("bunny", original, {}, (*parts(1, 2), *nearness(0.04, 0.22, 0.6)))

    def scan(self, level: int, request: Mapping[str, float], bounds: tuple[Bound, ...]) -> Work:
        return self._beside_original(f"dragon {level}", Mesh(*self.dragon.mesh(level)), request, bounds)

    def _beside_original(self, name: str, original: Mesh, request: Mapping[str, float], bounds: tuple[Bound, ...]) -> Work:
        """A mesh of the vertices of another one. `step` in the request is in spacings."""
        points, sums, _ = of_mesh(original.vertices, original.cells)
        lengths = np.linalg.norm(sums, axis=1, keepdims=True)
        normals = sums / np.where(lengths > 0, lengths, 1)
        spacing = spacing_of(points)
        asked = {name: value * spacing for name, value in request.items()}

        def figures(mesh: Mesh) -> dict[str, Figure]:
            off = distances(mesh.vertices, original) / spacing
            back = distances(points, mesh) / spacing
            near = dict(zip(DISTANCES, (off.mean(), np.quantile(off, 0.99), off.max()), strict=True))
            found = {name: Figure(float(value), "h") for name, value in near.items()}
            found["back, 99 %"] = Figure(float(np.quantile(back, 0.99)), "h")
            return {**topology_of(mesh), **found}

        def ours() -> Entry:
            work = self.service.ask(PATH, points, asked)
            return entry(OURS, work, figures(mesh_of(work)), notes(work))

        def others() -> Iterable[Entry]:
            for method, who, size in PEERS:
                work = self.peers.python(method, {"points": points, "normals": normals}, size=size)
                yield entry(f"{who}, true normals", work, figures(mesh_of(work)))

        step = f", step of {request['step']} spacings" if request else ", nothing chosen"
        return Work(f"{name}, {len(points):,} points{step}: distances in spacings", bounds, DISTANCES, ours, others)

    def million(self) -> Work:
        n = self.setting.size(1_000_000, 2_000)
        points = torus(n).points

        def ours() -> Entry:
            work = self.service.ask(PATH, points, {"step": 2 * spacing_of(points)})
            mesh = mesh_of(work)
            off = off_torus(mesh.vertices, 2.0, 0.5) / spacing_of(points)
            return entry(OURS, work, {**topology_of(mesh), "largest": Figure(float(off.max()), "h")}, notes(work))

        what = f"random torus (2, 1/2), {n:,} points, step of 2 spacings"
        return Work(what, (*costs(90, 3), *characteristic(0, 0)), {"largest": "h"}, ours, tuple)

    def noise(self) -> Work:
        """Noisy bodies. Figures are the least and the greatest share of vertices whose band covers the truth."""
        n = self.setting.size(3_000, 1_000)

        def ours() -> Entry:
            shares, seconds, peak = {}, 0.0, 0
            for name, (points, off) in exact_bodies(n).items():
                for spacings in (0.5, 1.0):
                    noise = spacings * spacing_of(points) * np.random.default_rng(1).standard_normal(points.shape)
                    try:
                        work = self.service.ask(PATH, points + noise, {"include": ["std"]})
                    except NotServed:
                        shares[f"{name} {spacings}, refused"] = 0.0
                        continue
                    deviations = np.ravel(work.arrays["position_std"])
                    known = np.isfinite(deviations)
                    covered = off(work.arrays["vertices"][known]) <= accuracy.BAND * deviations[known]
                    shares[f"{name} {spacings}"] = 100 * float(covered.mean())
                    seconds, peak = max(seconds, work.seconds), max(peak, work.peak_bytes)
            figures = {"least": Figure(min(shares.values()), "%"), "most": Figure(max(shares.values()), "%")}
            costs = {"time": Figure(seconds, "s"), "memory": Figure(peak, "B")}
            return Entry(OURS, {**costs, **figures}, ", ".join(f"{name}: {share:.1f}" for name, share in shares.items()))

        what = f"noise of 1/2 and 1 spacing, {n:,} points: vertices whose band of 95 % covers the truth"
        return Work(what, (Bound("least", "≥", 90), Bound("most", "≤", 99.5)), {"least": "%", "most": "%"}, ours, tuple)


def bodies(n: int) -> Bodies:
    """Points of closed bodies, with the Euler characteristics of their parts."""
    ring = thick_torus(n)[0]
    thin, other = torus(n).points, torus(n, seed=1).points
    linked = np.concatenate([thin, other[:, [0, 2, 1]] + [2.0, 0, 0]])
    return {
        "sphere": (sphere(n), [2]),
        "torus": (ring, [0]),
        "double torus": (double_torus(n), [-2]),
        "two linked tori": (linked, [0, 0]),
    }


def double_torus(n: int) -> Floats:
    """Random points on (x²(1 − x²) − y²)² + z² = 0.01, a surface of genus 2, by Newton's method."""
    random = np.random.default_rng(5)
    points = random.uniform([-1.2, -0.8, -0.3], [1.2, 0.8, 0.3], (60 * n, 3))
    for _ in range(30):
        x, y, z = points.T
        inner = x**2 * (1 - x**2) - y**2
        value = inner**2 + z**2 - 0.01
        gradient = np.column_stack([2 * inner * (2 * x - 4 * x**3), -4 * inner * y, 2 * z])
        squares = np.maximum(np.einsum("ij,ij->i", gradient, gradient), 1e-9)
        points = points - np.clip(value / squares, -0.2, 0.2)[:, None] * gradient
    x, y, z = points.T
    is_near = np.abs((x**2 * (1 - x**2) - y**2) ** 2 + z**2 - 0.01) < 1e-10
    return spread(points[is_near], n)


def spread(points: Floats, n: int) -> Floats:
    """Returns n of the points, each as far as possible from those before it."""
    chosen = [0]
    distance = np.linalg.norm(points - points[0], axis=1)
    for _ in range(n - 1):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def exact_bodies(n: int) -> dict[str, tuple[Floats, Callable[[Floats], Floats]]]:
    """Points of bodies, with the distance of any place from their surface."""
    axes = np.array([2.0, 1.0, 1.0])

    def off_ellipsoid(places: Floats) -> Floats:
        """To first order, which is exact enough within a few hundredths of the surface."""
        value = np.einsum("ij,ij->i", places / axes, places / axes)
        return np.abs(value - 1) / (2 * np.linalg.norm(places / axes**2, axis=1))

    return {
        "sphere": (sphere(n), lambda places: np.abs(np.linalg.norm(places, axis=1) - 1)),
        "torus": (torus(n).points, lambda places: off_torus(places, 2.0, 0.5)),
        "ellipsoid": (sphere(n) * axes, off_ellipsoid),
    }


def off_torus(places: Floats, major: float, minor: float) -> Floats:
    ring = np.hypot(places[:, 0], places[:, 1]) - major
    return np.abs(np.hypot(ring, places[:, 2]) - minor)


def spacing_of(points: Floats) -> float:
    """Returns the median over the points of the mean distance to the four nearest, as the service has it."""
    found, _ = cKDTree(points).query(points, 5, workers=2)
    return float(np.median(found[:, 1:].mean(axis=1)))


def mesh_of(work: Done) -> Mesh:
    cells = work.arrays["cells"] if "cells" in work.arrays else getattr(work, "members", {})["cells"]
    return Mesh(np.asarray(work.arrays["vertices"]), np.asarray(cells).astype(np.int64).reshape(-1, 3))


def topology_of(mesh: Mesh) -> dict[str, Figure]:
    found = topology(mesh)
    return {
        "χ": Figure(sum(found.characteristics)),
        "parts": Figure(len(found.characteristics)),
        "unpaired": Figure(found.n_unpaired),
        "pinched": Figure(found.n_pinched),
    }


def parts(most: int, least: int) -> tuple[Bound, ...]:
    """Bounds of a closed mesh of at most so many parts, with no characteristic below `least`."""
    return (Bound("parts", "≤", most), Bound("χ", "≥", least), Bound("unpaired", "≤", 0), Bound("pinched", "≤", 0))


def characteristic(least: int, most: int) -> tuple[Bound, ...]:
    return (*parts(1, least), Bound("χ", "≤", most))


def nearness(*limits: float) -> tuple[Bound, ...]:
    return tuple(Bound(name, "≤", limit) for name, limit in zip(DISTANCES, limits, strict=True))


def costs(seconds: float, gigabytes: float) -> tuple[Bound, Bound]:
    return Bound("time", "≤", seconds), Bound("memory", "≤", 1e9 * gigabytes)


def entry(who: str, work: Done, figures: Mapping[str, Figure], remark: str = "") -> Entry:
    return Entry(who, {"time": Figure(work.seconds, "s"), "memory": Figure(work.peak_bytes, "B"), **figures}, remark)


def notes(work: Answered) -> str:
    """Formats the solver, what was left out, and warnings."""
    members: Mapping[str, Any] = work.members
    diagnostics = members.get("diagnostics", {})
    codes = sorted({warning["code"] for warning in diagnostics.get("warnings", [])})
    n_dropped = len(members.get("dropped_parts", []))
    return ", ".join([f"solver {diagnostics.get('solver')}", f"{n_dropped} parts left out", *codes])
