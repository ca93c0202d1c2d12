"""Clouds in tiles, compared with one request for all of their points."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterator
from functools import partial
from typing import Any

import dask
import dask.array as da
import distributed
import httpx
import numpy as np
import pytest
from scipy.sparse import csr_matrix

import gramian
import gramian.dask
from gramian.dask.cells.cut import Cut
from gramian.dask.cells.parts import Reach, distinct, join, look, rim, split
from gramian.dask.surface import probe
from gramian.tiles.operations import choose_coarse
from gramian.tiles.replicas import Replicas
from gramian.wire.tensors import Array

NOWHERE = "http://127.0.0.1:9"


def torus(n: int, seed: int = 0) -> Array:
    """Returns random points on a torus of radii 2 and 0.5, uniform by area."""
    random = np.random.default_rng(seed)
    v = random.uniform(0, 2 * np.pi, 4 * n)
    v = v[random.uniform(0, 2.5, 4 * n) < 2 + np.cos(v) / 2][:n]
    u, distance = random.uniform(0, 2 * np.pi, n), 2 + np.cos(v) / 2
    return np.column_stack([distance * np.cos(u), distance * np.sin(u), np.sin(v) / 2])


@pytest.fixture(autouse=True)
def _threads() -> Iterator[None]:
    with dask.config.set(scheduler="threads", num_workers=2):
        yield


@pytest.fixture(scope="module")
def points() -> Array:
    return torus(6000)


@pytest.fixture
def service() -> gramian.dask.Service:
    return gramian.dask.connect()


@pytest.fixture
def another() -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Starts a second server; yields its address and process."""
    binary = os.environ.get("GRAMIAN_BINARY")
    if not binary:
        pytest.skip("tests/with_server.py says which binary to start")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GRAMIAN_")}
    command = [binary, "--bind", "127.0.0.1:0"]
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        lines = (re.search(r'"address":"([^"]+)"', line) for line in process.stderr)
        yield next(f"http://{found[1]}" for found in lines if found), process
        process.kill()


def assert_same(found: Any, single: gramian.Normals | gramian.Curvatures) -> None:
    """Asserts that all numbers and flags are equal up to rounding."""
    for name, array in vars(found).items():
        if name == "reasons":
            flagged = {entry.query: entry.reason.value for entry in single.flags}
            assert {row: reason for row, reason in enumerate(array.tolist()) if reason} == flagged
        elif array is not None:
            expected = getattr(single, name)
            np.testing.assert_allclose(array, expected, rtol=0, atol=1e-9 * np.nanmax(np.abs(expected)), err_msg=name)


def test_surfaces_are_those_of_one_request(
    client: gramian.Client, service: gramian.dask.Service, points: Array
) -> None:
    tiles = service.tiles(da.from_array(points, chunks=(1700, 3)), n_tiles=4)
    assert np.bincount(tiles.cells().compute()).tolist() == [1500] * 4
    normals, curvatures, laplace, gradient = dask.compute(
        tiles.normals(), tiles.curvatures(std=True), tiles.laplace_beltrami(), tiles.surface_gradient()
    )
    cloud = client.cloud(points)
    assert_same(normals, cloud.normals(solver="local", hyperparameters=tiles.hyperparameters))
    assert_same(curvatures, cloud.curvatures(solver="local", std=True, hyperparameters=tiles.hyperparameters))
    assert curvatures.mean_curvature_std.shape == (6000,)
    learned = cloud.normals(points[:1], solver="local", sites=tiles.plan.sites.points).diagnostics
    assert learned.hyperparameters == tiles.hyperparameters
    of_all = [cloud.laplace_beltrami_sparse_matrix(solver="local", hyperparameters=tiles.hyperparameters).matrix]
    of_all += cloud.surface_gradient_sparse_matrix(solver="local", hyperparameters=tiles.hyperparameters).matrices
    for matrix, expected in zip([*laplace.matrices, *gradient.matrices], of_all, strict=True):
        assert isinstance(matrix, csr_matrix)
        assert np.array_equal(matrix.indices, expected.indices)
        assert abs(matrix - expected).max() <= 1e-9 * abs(expected).max()


def test_operators_are_applied_in_blocks(service: gramian.dask.Service, points: Array) -> None:
    tiles = service.tiles(da.from_array(points, chunks=(2500, 3)), n_tiles=3)
    laplace = tiles.laplace_beltrami()
    (applied,) = laplace.apply(points[:, 2])
    assert applied.chunks == ((2500, 2500, 1000),)
    found, matrix = dask.compute(applied, laplace.matrices[0])
    np.testing.assert_allclose(found, matrix @ points[:, 2])


@pytest.mark.parametrize("n_tiles", [1, 3])
def test_points_may_coincide_and_be_few(client: gramian.Client, service: gramian.dask.Service, n_tiles: int) -> None:
    points = torus(900)
    points = np.concatenate([points, points[:40]])
    tiles = service.tiles(points, n_tiles)
    (found,) = dask.compute(tiles.curvatures(std=True))
    assert_same(found, client.cloud(points).curvatures(solver="local", std=True, hyperparameters=tiles.hyperparameters))


def test_tiles_without_a_surface_have_no_normals(service: gramian.dask.Service) -> None:
    grid = np.stack(np.meshgrid(*[np.arange(8.0)] * 2), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid, np.zeros((64, 2))])  # a plane in four dimensions
    (found,) = dask.compute(service.tiles(points, n_tiles=2).normals())
    assert np.isnan(found.normals).all()
    assert set(found.reasons.tolist()) == {"vanishing_gradient"}


def test_coarse_and_open_clouds_have_one_side(service: gramian.dask.Service, client: gramian.Client) -> None:
    x, y = np.random.default_rng(2).uniform(-1, 1, (2, 4000))
    points = np.column_stack([x, y, np.sin(3 * x) * np.cos(3 * y) / 3])  # a sheet: its side is arbitrary
    normals = service.tiles(points, n_tiles=6).normals().normals.compute()
    expected = client.cloud(points).normals(solver="local").normals
    cosines = (normals * expected).sum(axis=1)
    assert np.abs(cosines).min() > 1 - 1e-9
    assert len(set(np.sign(cosines).tolist())) == 1
    assert len(set(np.sign(normals[:, 2]).tolist())) == 1


def test_values_are_those_of_one_request(client: gramian.Client, service: gramian.dask.Service) -> None:
    random = np.random.default_rng(1)
    points, queries = random.uniform(size=(5000, 3)), random.uniform(-0.1, 1.1, size=(700, 3))
    values = np.sin(4 * points[:, 0]) * points[:, 1] + 2
    tiles = service.tiles(points, n_tiles=5)
    kernel = gramian.Kernel("matern", length_scales=[0.3, 0.6, 1.2])
    fit = gramian.ValuesFit(kernel=kernel, alpha=1e-3, mean="zero", solver="local")
    found = tiles.interpolate(
        values, da.from_array(queries, chunks=(300, 3)), derivatives=1, std=True, kernel=kernel, alpha=1e-3
    )
    assert found.values.chunks == ((300, 300, 100),)
    (found,) = dask.compute(found)
    single = client.cloud(points).interpolate(values, queries, derivatives=1, std=True, **fit)
    for name in ("values", "gradients", "value_std", "gradient_std"):
        np.testing.assert_allclose(getattr(found, name), getattr(single, name), rtol=1e-9, atol=1e-9, err_msg=name)
    assert found.hessians is None


def test_a_kernel_is_learned_where_none_is_given(service: gramian.dask.Service) -> None:
    points = np.random.default_rng(1).uniform(size=(3000, 2))
    values = 3 + np.sin(4 * points[:, 0]) * points[:, 1]
    found = service.tiles(points, n_tiles=3).interpolate(da.from_array(values, chunks=700), points[:50], mean="linear")
    np.testing.assert_allclose(found.values.compute(), values[:50], atol=1e-3)


def test_tiles_are_tasks_of_a_cluster(client: gramian.Client, points: Array) -> None:
    urls = [NOWHERE, str(client._connection.http.base_url)]  # no service at the first, then the next is asked
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, protocol="inproc://"
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as scheduler,
        dask.config.set(scheduler=scheduler.get),
    ):
        tiles = gramian.dask.connect(urls).tiles(points, n_tiles=4)
        (normals,) = dask.compute(tiles.normals(), retries=2)
    assert_same(normals, client.cloud(points).normals(solver="local", hyperparameters=tiles.hyperparameters))


def test_a_replica_may_die(another: tuple[str, subprocess.Popen[str]], client: gramian.Client, points: Array) -> None:
    url, process = another
    tiles = gramian.dask.connect([url, str(client._connection.http.base_url)]).tiles(points, n_tiles=4)
    normals = tiles.normals()  # the first replica has already answered for the sample
    process.kill()
    process.wait()
    (found,) = dask.compute(normals)
    assert_same(found, client.cloud(points).normals(solver="local", hyperparameters=tiles.hyperparameters))


def test_replicas_are_asked_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gramian.tiles.replicas.PAUSE_SECONDS", 0.0)
    asked: list[str] = []

    def fails(client: gramian.Client) -> None:
        asked.append(str(client._connection.http.base_url).rstrip("/")[-1])
        raise httpx.ReadError("gone")

    replicas = Replicas(("http://a:1", "http://a:2", "http://a:3"))
    with pytest.raises(httpx.ReadError):
        replicas.ask(7, fails)
    assert asked == ["2", "3", "1"] * 4

    def refuses(client: gramian.Client) -> None:
        asked.append("")
        client.cloud([[0.0]]).normals()

    asked.clear()
    with pytest.raises(gramian.Problem, match="dimension 2 or more"):
        gramian.dask.connect().replicas.ask(0, refuses)
    assert asked == [""]  # another replica would refuse it too


def test_every_point_finds_its_nearest_in_its_tile() -> None:
    random = np.random.default_rng(3)
    points = np.round(random.normal(size=(2000, 3)), 1) ** 3  # uneven, with ties and points that coincide
    cut, reach = Cut.of(points, 7), Reach(20)
    pieces = [split(points[first : first + 600], first, cut) for first in range(0, 2000, 600)]
    cores = [join([piece[cell] for piece in pieces]) for cell in range(7)]
    assert sorted(np.concatenate([core.index for core in cores]).tolist()) == list(range(2000))
    positions = points[distinct(points)]
    for cell, core in enumerate(cores):
        looking = look(core, cell, cut, reach)
        rims = [rim(other, looking, reach) for at, other in enumerate(cores) if at != cell]
        near = join([core, *rims]).points
        near = near[distinct(near)]
        for x in core.points[::9]:
            of_all, of_tile = (np.sort(((these - x) ** 2).sum(axis=1))[:20] for these in (positions, near))
            np.testing.assert_array_equal(of_all, of_tile)


@pytest.mark.parametrize(("n", "n_cells"), [(1000, 1), (1000, 8), (999, 5), (3, 3)])
def test_cells_have_equally_many_points(n: int, n_cells: int) -> None:
    points = np.random.default_rng(0).normal(size=(n, 2))
    cut = Cut.of(points, n_cells)
    counts = np.bincount(cut.cells_of(points), minlength=n_cells)
    assert counts.max() - counts.min() <= 2
    for cell in range(n_cells):
        assert (cut.depths(cell, points[cut.cells_of(points) == cell]) >= 0).all()


def test_large_clouds_learn_what_they_would_as_a_whole(
    client: gramian.Client, service: gramian.dask.Service, points: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gramian.dask.surface.PROBE_POINTS", 4000)
    tiles = service.tiles(points, n_tiles=2)
    cloud = client.cloud(points)
    learned = cloud.normals(points[:1], solver="local", sites=tiles.plan.sites.points).diagnostics.hyperparameters
    for name in ("length_scale", "variance", "noise_deviation", "radius"):  # up to the order of sums
        np.testing.assert_allclose(
            getattr(tiles.hyperparameters, name), getattr(learned, name), rtol=1e-9, err_msg=name
        )
    assert len(probe(tiles.plan, tiles._points)) == 3000


def grains(n_of_each: int, per_axis: int) -> tuple[Array, Array]:
    """Returns points of small spheres on a grid, in random order, and their normals."""
    random = np.random.default_rng(7)
    centres = np.stack(np.meshgrid(*[np.arange(per_axis)] * 3), axis=-1).reshape(-1, 3)
    outward = random.normal(size=(len(centres) * n_of_each, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    order = random.permutation(len(outward))
    return (np.repeat(centres, n_of_each, axis=0) + 0.25 * outward)[order], outward[order]


def test_small_pieces_have_the_side_of_their_volume(
    service: gramian.dask.Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, outward = grains(90, per_axis=4)
    few = partial(choose_coarse, count=192)  # three points of each
    monkeypatch.setattr("gramian.dask.surface.choose_coarse", few)
    (found,) = dask.compute(service.tiles(points, n_tiles=3).normals())
    cosines = (found.normals * outward).sum(axis=1)
    # A piece has 90 points. Where these leave a hole, a single normal may be off by more than 90 degrees.
    assert np.count_nonzero(cosines < 0) <= 3
    assert "uncertain_orientation" not in found.reasons


@pytest.mark.parametrize(
    ("points", "n_tiles", "message"),
    [
        ([1.0, 2.0], 1, r"\[n, d\], not \[2\]"),
        (np.empty((0, 3)), 1, "it is empty"),
        (da.empty((0, 3)), 1, "no rows"),
        (np.zeros((5, 3)), 6, "from 1 to the number of points, 5, not 6"),
        ([[0.0, 1.0], [np.nan, 0.0]], 1, r"points\[1, 0\] is nan"),
    ],
)
def test_what_cannot_be_cut_is_refused(points: Any, n_tiles: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        gramian.dask.connect().tiles(points, n_tiles)


def test_blocks_may_have_unknown_sizes(service: gramian.dask.Service) -> None:
    points = da.from_array(torus(2000), chunks=(600, 3))
    upper = points[points[:, 0] > 0]
    answer = service.tiles(upper, n_tiles=2).normals()
    assert answer.normals.compute().shape == (int((points[:, 0] > 0).sum().compute()), 3)
