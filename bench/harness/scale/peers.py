"""Peers, each run in a separate process: `python -m harness.scale.peers NAME < INPUT > OUTPUT`.

INPUT and OUTPUT are npz. Time is that of the work alone, on points in memory. The peak resident memory is
that of the process, Python included. Arguments of a method are customary numbers unless the table says
otherwise.
"""

import hashlib
import inspect
import io
import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..clouds import Floats
from ..setting import Setting
from ..timing import timed

Arrays = dict[str, Floats]


@dataclass(frozen=True)
class Done:
    """Arrays that a peer or the service answered, with seconds and peak bytes.

    Peak bytes include those of the idle process.
    """

    seconds: float
    peak_bytes: int
    arrays: Mapping[str, Floats]


class Peers:
    """Runs peers, or reads their earlier results for the same input where `uses_cache` allows it."""

    def __init__(self, setting: Setting, uses_cache: bool) -> None:
        self._setting = setting
        self._uses_cache = uses_cache
        self._folder = setting.build / "scale" / "peers"
        self._folder.mkdir(parents=True, exist_ok=True)

    def cgal(self, what: str, points: Floats, *arguments: int, rounds: int = 1) -> Done:
        """Runs bench/peers/cgal_surface.cpp; returns the fastest of several rounds.

        `what` is `normals`, `oriented` or `curvatures`.
        """
        command = [str(self._setting.build / "cgal_surface"), what, *map(str, arguments)]

        def run() -> Done:
            done = subprocess.run(command, input=points.tobytes(), check=True, capture_output=True, env=self._environment)
            seconds, peak = done.stderr.split()
            rows = np.frombuffer(done.stdout).reshape(len(points), -1)
            return Done(float(seconds), int(peak), {"normals": rows[:, :3], "curvatures": rows[:, 3:]})

        source = self._setting.root / "bench" / "peers" / "cgal_surface.cpp"
        return self._once(["cgal", what, *arguments], source.read_text(), {"points": points}, lambda: fastest(run, rounds))

    def python(self, name: str, arrays: Arrays, rounds: int = 1, **arguments: float) -> Done:
        """Runs one of `METHODS`; returns the fastest of several rounds."""
        command = [str(self._setting.python), "-m", "harness.scale.peers", name, json.dumps(arguments)]

        def run() -> Done:
            file = io.BytesIO()
            np.savez(file, **arrays)
            done = subprocess.run(command, input=file.getvalue(), check=True, stdout=subprocess.PIPE, env=self._environment)
            found = dict(np.load(io.BytesIO(done.stdout)))
            seconds, peak = found.pop("cost")
            return Done(float(seconds), int(peak), found)

        return self._once([name, arguments], inspect.getsource(METHODS[name]), arrays, lambda: fastest(run, rounds))

    @property
    def _environment(self) -> dict[str, str]:
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "2")
        return {**self._setting.environment, **threads}

    def _once(self, what: list[Any], source: str, arrays: Arrays, run: Callable[[], Done]) -> Done:
        digest = hashlib.sha256(json.dumps([what, source]).encode())
        for array in arrays.values():
            digest.update(np.ascontiguousarray(array).tobytes())
        kept = self._folder / f"{what[0]}-{digest.hexdigest()[:24]}.npz"
        if self._uses_cache and kept.exists():
            found = dict(np.load(kept))
            seconds, peak = found.pop("cost")
            return Done(float(seconds), int(peak), found)
        work = run()
        np.savez(kept, cost=np.array([work.seconds, work.peak_bytes]), **work.arrays)
        return work


def fastest(run: Callable[[], Done], rounds: int) -> Done:
    return min((run() for _ in range(rounds)), key=lambda done: done.seconds)


def quadrics(points: Floats, n_neighbours: int, is_oriented: int) -> Arrays:
    """Quadrics by NumPy on all points."""
    from .fits import jets, oriented

    found = jets(points, points, n_neighbours, 2)
    if not is_oriented:
        return {"normals": found.normals, "curvatures": found.curvatures}
    return {"normals": oriented(points, found.normals)}


def open3d(points: Floats, n_neighbours: int, is_oriented: int) -> Arrays:
    """Principal axes, and signs that agree along a spanning tree."""
    import open3d as library

    cloud = library.geometry.PointCloud(library.utility.Vector3dVector(points))
    cloud.estimate_normals(library.geometry.KDTreeSearchParamKNN(n_neighbours))
    if is_oriented:
        cloud.orient_normals_consistent_tangent_plane(n_neighbours)
    return {"normals": np.asarray(cloud.normals)}


def laplacian(points: Floats, values: Floats, n_neighbours: int) -> Arrays:
    """−M⁻¹Lf by robust_laplacian, and the energy fᵀLf, which it is made for."""
    import robust_laplacian

    stiffness, mass = robust_laplacian.point_cloud_laplacian(points, n_neighbors=n_neighbours)
    forces = stiffness @ values
    return {"values": -forces / mass.diagonal(), "energy": np.array(values @ forces)}


def interpolation(points: Floats, values: Floats, queries: Floats, n_neighbours: int) -> Arrays:
    """SciPy's radial basis functions of the nearest points: means alone."""
    from scipy.interpolate import RBFInterpolator

    return {"means": RBFInterpolator(points, values, neighbors=n_neighbours)(queries)}


def ferreus(points: Floats, values: Floats, queries: Floats, length_scale: float, nugget: float, tolerance: float) -> Arrays:
    """The exponential kernel by a fast multipole method: means alone. Its kernel is exp(−3 r)."""
    import ferreus_rbf as library
    from ferreus_rbf import interpolant_config as options

    accuracy = options.FittingAccuracy(tolerance, options.FittingAccuracyType.Relative)
    settings = options.InterpolantSettings(
        options.RBFKernelType.Exponential, drift=options.Drift.None_, nugget=nugget, fitting_accuracy=accuracy
    )
    unit = 1 / (3 * length_scale)
    fitted = library.RBFInterpolator(unit * points, values.reshape(-1, 1), settings)
    return {"means": np.asarray(fitted.evaluate(unit * queries)).ravel()}


def process(points: Floats, values: Floats, queries: Floats, length_scale: float, alpha: float) -> Arrays:
    """scikit-learn's Gaussian process with fixed hyperparameters: means and variances."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF

    kernel = RBF(length_scale / np.sqrt(2), length_scale_bounds="fixed")
    fitted = GaussianProcessRegressor(kernel, alpha=alpha, optimizer=None).fit(points, values)
    means, deviations = fitted.predict(queries, return_std=True)
    return {"means": means, "variances": deviations**2}


def gpytorch(points: Floats, values: Floats, queries: Floats, length_scale: float, alpha: float) -> Arrays:
    """GPyTorch's Gaussian process with a Gauss kernel, by Cholesky: means and variances."""
    from ..gpytorch_peer import gauss, posterior

    means, deviations = posterior(points, values, queries, gauss(length_scale), alpha)
    return {"means": means, "variances": deviations**2}


def gpytorch_mean(points: Floats, values: Floats, queries: Floats, length_scale: float, alpha: float) -> Arrays:
    """The same by conjugate gradients, which it chooses by itself: means alone."""
    from ..gpytorch_peer import gauss, mean

    return {"means": mean(points, values, queries, gauss(length_scale), alpha)}


def poisson(points: Floats, normals: Floats, size: int) -> Arrays:
    """Screened Poisson reconstruction to an octree of depth `size`, from the true normals.

    Points without a normal, whose faces contradict each other, are left out, since it refuses them.
    """
    scene = meshlab(points, normals)
    scene.generate_surface_reconstruction_screened_poisson(depth=size, preclean=True)
    return current_mesh(scene)


def apss(points: Floats, normals: Floats, size: int) -> Arrays:
    """Marching cubes on algebraic point set surfaces, a grid of `size` along the longest side."""
    scene = meshlab(points, normals)
    scene.generate_marching_cubes_apss(resolution=size)
    return current_mesh(scene)


def meshlab(points: Floats, normals: Floats) -> Any:
    import pymeshlab

    scene = pymeshlab.MeshSet()
    scene.add_mesh(pymeshlab.Mesh(vertex_matrix=points, v_normals_matrix=normals))
    return scene


def current_mesh(scene: Any) -> Arrays:
    mesh = scene.current_mesh()
    return {"vertices": mesh.vertex_matrix(), "cells": mesh.face_matrix().astype(np.float64)}


METHODS: dict[str, Callable[..., Arrays]] = {
    "quadrics": quadrics,
    "open3d": open3d,
    "laplacian": laplacian,
    "interpolation": interpolation,
    "ferreus": ferreus,
    "process": process,
    "gpytorch": gpytorch,
    "gpytorch_mean": gpytorch_mean,
    "poisson": poisson,
    "apss": apss,
}


def peak_bytes() -> int:
    """Returns the peak resident memory of this process.

    Unlike that of `getrusage`, it does not include the process that started this one.
    """
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:"))


def main() -> None:
    method, arguments = METHODS[sys.argv[1]], json.loads(sys.argv[2])
    arrays = dict(np.load(io.BytesIO(sys.stdin.buffer.read())))
    # Imports do not count as work: a first call on a few points does them.
    few = {name: array[:200] for name, array in arrays.items()}
    method(**few, **arguments)
    found, seconds = timed(lambda: method(**arrays, **arguments))
    cost = np.array([seconds, peak_bytes()])
    file = io.BytesIO()
    np.savez(file, cost=cost, **found)
    sys.stdout.buffer.write(file.getvalue())


if __name__ == "__main__":
    main()
