"""Laplace–Beltrami, normals and curvatures beside robust_laplacian, Open3D and CGAL, in time and accuracy.

The peers are local methods, linear in n. Ours solves for one function through all points, n³. For errors,
less is better.
"""

import subprocess
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import open3d
import robust_laplacian

from ..clouds import Floats, harmonic, sphere, torus
from ..report import Figure, Row
from ..server import Client
from ..setting import Setting
from ..timing import SPIN_SECONDS, Times, alternate, timed

#: Number of neighbours of a local fit, customary for each peer.
NEIGHBOURS = 30

KERNEL = {"family": "matern", "nu": 8.5, "length_scale": 0.5}


def measure(setting: Setting) -> Iterable[Row]:
    with setting.gramian() as server:
        client = server.client()
        yield from laplacians(setting, client)
        yield from normals(setting, client)
        yield from curvatures(setting, client)


def laplacians(setting: Setting, client: Client) -> Iterable[Row]:
    points = sphere(setting.size(4000))
    exact = -12 * harmonic(points)

    def ours() -> Floats:
        request = {"cloud": {"points": points}, "kernel": KERNEL, "values": harmonic(points)}
        return np.array(ask(client, "/v1/laplace-beltrami", request)["laplacians"])

    def theirs() -> Floats:
        # The stiffness matrix L is weak and positive: Δu = −M⁻¹ L u with the lumped mass matrix M.
        stiffness, mass = robust_laplacian.point_cloud_laplacian(points, n_neighbors=NEIGHBOURS)
        return -(stiffness @ harmonic(points)) / mass.diagonal()

    def error(found: Floats) -> float:
        return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))

    times, results = contest(setting, ours, theirs)
    what = f"Laplace–Beltrami of xyz on the sphere, n = {len(points):,}: robust_laplacian"
    yield Row(
        f"{what}, time",
        *figures(times),
        None,
        "theirs: a sparse matrix, which also serves other values",
        is_contest=True,
    )
    stiffness, mass = robust_laplacian.point_cloud_laplacian(points, n_neighbors=NEIGHBOURS)
    u = harmonic(points)
    eigenvalue = (u @ (stiffness @ u)) / (u @ (mass @ u))
    remark = f"{described()}; theirs is meant weakly: uᵀLu/uᵀMu is {eigenvalue:.4f}, 12 would be exact"
    yield Row(f"{what}, relative error in L2", *errors(results, error, ""), None, remark, is_contest=True)


def normals(setting: Setting, client: Client) -> Iterable[Row]:
    points, exact, _ = torus(setting.size(4000))

    def theirs() -> Floats:
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
        return np.asarray(cloud.normals)

    def worst(found: Floats) -> float:
        return float(np.max(angles(found, exact)))

    def mean(found: Floats) -> float:
        return float(np.mean(angles(found, exact)))

    what = f"normals of a random torus, n = {len(points):,}: Open3D, PCA of {NEIGHBOURS} neighbours"
    for name, kernel in (("", KERNEL), (", no kernel given", None)):

        def ours(kernel: dict[str, Any] | None = kernel) -> Floats:
            request: dict[str, Any] = {"cloud": {"points": points}, **({} if kernel is None else {"kernel": kernel})}
            return rows(ask(client, "/v1/normals", request)["normals"], 3)

        times, results = contest(setting, ours, theirs)
        unoriented = "ours are oriented outward, theirs are not oriented; angles without sign"
        yield Row(f"{what}{name}, time", *figures(times), None, unoriented, is_contest=True)
        yield Row(f"{what}{name}, mean angle", *errors(results, mean, "°"), None, described(kernel), is_contest=True)
        yield Row(f"{what}{name}, worst angle", *errors(results, worst, "°"), None, described(kernel), is_contest=True)


def curvatures(setting: Setting, client: Client) -> Iterable[Row]:
    points, _, exact = torus(setting.size(4000))

    def theirs() -> Floats:
        return by_cgal(setting, points)[0]

    def ours() -> Floats:
        return rows(ask(client, "/v1/curvatures", {"cloud": {"points": points}, "kernel": KERNEL})["principal_curvatures"], 2)

    def median(found: Floats) -> float:
        return float(np.median(deviations(found, exact)))

    def worst(found: Floats) -> float:
        return float(np.max(deviations(found, exact)))

    times, results = contest(setting, ours, theirs)
    in_process = Times(tuple(by_cgal(setting, points)[1] for _ in range(setting.rounds(3))))
    what = f"curvatures of a random torus, n = {len(points):,}: CGAL jets of degree 4, {NEIGHBOURS} neighbours"
    yield Row(
        f"{what}, time",
        figures(times)[0],
        Figure.of(in_process),
        None,
        f"theirs: the fits alone, on one thread, in their process; with files and start {figures(times)[1]}",
        is_contest=True,
    )
    yield Row(f"{what}, median error", *errors(results, median, "1/L"), None, described(), is_contest=True)
    yield Row(f"{what}, worst error", *errors(results, worst, "1/L"), None, described(), is_contest=True)


def by_cgal(setting: Setting, points: Floats) -> tuple[Floats, float]:
    """Returns principal curvatures of jet fits and the seconds of the fits alone.

    Curvatures ascend and are for outward normals.
    """
    text = "\n".join(" ".join(f"{coordinate:.17g}" for coordinate in point) for point in points)
    command = [str(setting.build / "cgal_jets"), str(NEIGHBOURS)]
    output = subprocess.run(command, input=text, check=True, capture_output=True, text=True).stdout
    first, *lines = output.splitlines()
    found = np.array([[float(number) for number in line.split()] for line in lines])
    # CGAL's normals have arbitrary signs. On this torus, the curvature of larger magnitude is positive for
    # outward normals.
    flipped = np.abs(found).argmax(axis=1) == found.argmin(axis=1)
    found[flipped] *= -1
    return np.sort(found, axis=1), float(first)


def contest(
    setting: Setting, ours: Callable[[], Floats], theirs: Callable[[], Floats]
) -> tuple[dict[str, Times], dict[str, Floats]]:
    results: dict[str, Floats] = {}

    def run(name: str, method: Callable[[], Floats]) -> float:
        results[name], seconds = timed(method)
        return seconds

    tasks = {"ours": lambda _: run("ours", ours), "theirs": lambda _: run("theirs", theirs)}
    times = alternate(setting.rounds(4), tasks, SPIN_SECONDS)
    return times, results


def ask(client: Client, path: str, request: dict[str, Any]) -> Any:
    """Sends a cold request: deletes the cloud at once. Our time includes the deletion."""
    answer = client.post(path, request)
    client.forget(answer)
    return answer.json()


def rows(entries: list[list[float] | None], width: int) -> Floats:
    """Converts rows to an array. A null, which stands for a refused answer, becomes NaN."""
    return np.array([[np.nan] * width if entry is None else entry for entry in entries])


def angles(found: Floats, exact: Floats) -> Floats:
    """Returns degrees between lines by atan2, which keeps small angles precise where a cosine loses them."""
    sines = np.linalg.norm(np.cross(found, exact), axis=1)
    return np.degrees(np.arctan2(sines, np.abs(np.sum(found * exact, axis=1))))


def deviations(found: Floats, exact: Floats) -> Floats:
    """Returns the larger of the two errors at each point."""
    return np.max(np.abs(found - exact), axis=1)


def figures(times: dict[str, Times]) -> tuple[Figure, Figure]:
    return Figure.of(times["ours"]), Figure.of(times["theirs"])


def errors(results: dict[str, Floats], error: Callable[[Floats], float], unit: str) -> tuple[Figure, Figure]:
    return Figure(error(results["ours"]), unit), Figure(error(results["theirs"]), unit)


def described(kernel: dict[str, Any] | None = KERNEL) -> str:
    return "" if kernel is None else f"ours: Matérn, ν = {kernel['nu']}, ℓ = {kernel['length_scale']}"
