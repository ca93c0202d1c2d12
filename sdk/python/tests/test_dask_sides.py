"""Sides of the pieces of clouds in tiles."""

from __future__ import annotations

from collections.abc import Iterator

import dask
import numpy as np
import pytest
from scipy.spatial import cKDTree

import gramian
import gramian.dask
from gramian.dask.cells.cut import Ints
from gramian.dask.orientation.measures import Truths
from gramian.dask.orientation.regions import Regions
from gramian.dask.orientation.signs import joined
from gramian.wire.tensors import Array


@pytest.fixture(autouse=True)
def _threads() -> Iterator[None]:
    with dask.config.set(scheduler="threads", num_workers=2):
        yield


def sphere(n: int, seed: int = 0) -> Array:
    points = np.random.default_rng(seed).normal(size=(n, 3))
    unit: Array = points / np.linalg.norm(points, axis=1, keepdims=True)
    return unit


def ring(n: int, tube: float, seed: int = 0) -> tuple[Array, Array]:
    """Returns random points of a torus of radius 1, and their normals."""
    u, v = np.random.default_rng(seed).uniform(0, 2 * np.pi, (2, n))
    normals = np.column_stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)])
    return np.column_stack([np.cos(u), np.sin(u), np.zeros(n)]) + tube * normals, normals


def grains(n_of_each: int, per_axis: int) -> tuple[Array, Array]:
    """Returns points of small spheres on a grid, in random order, and their normals."""
    random = np.random.default_rng(7)
    centres = np.stack(np.meshgrid(*[np.arange(per_axis)] * 3), axis=-1).reshape(-1, 3)
    outward = random.normal(size=(len(centres) * n_of_each, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    order = random.permutation(len(outward))
    return (np.repeat(centres, n_of_each, axis=0) + 0.25 * outward)[order], outward[order]


def sides(
    points: Array, normals: Array, directions: Array, coarse: Ints | None = None, cells: Ints | None = None
) -> tuple[Array, Truths]:
    """Finds signs of normals in tiles, and the doubtful ones. Tiles have halos of a tenth of the cloud."""
    n = len(points)
    cells = np.zeros(n, dtype=np.int64) if cells is None else cells
    rows = np.arange(0, n, 50, dtype=np.int64) if coarse is None else coarse
    found, labels, shared, owned = [], [], [], []
    for cell in range(int(cells.max()) + 1):
        distances, _ = cKDTree(points[cells == cell]).query(points)
        near = np.flatnonzero(distances < 0.2)
        own = np.flatnonzero(cells[near] == cell)
        of_points, regions = Regions.of(near, points[near], normals[near], directions[near], own, rows)
        found.append(regions)
        labels.append(of_points[own])
        shared.append((near[own], of_points[own]))
        owned.append(near[own])
    signs, are_doubtful = np.zeros(n), np.zeros(n, dtype=bool)
    for at, of_own, of_tile in zip(owned, labels, joined(found, shared), strict=True):
        signs[at], are_doubtful[at] = of_tile.signs[of_own], of_tile.are_doubtful[of_own]
    return signs, are_doubtful


@pytest.mark.parametrize("n_tiles", [1, 3])
def test_flipped_regions_are_turned_outward(n_tiles: int) -> None:
    outward = sphere(3000)
    expected = np.where(outward[:, 2] > 0.2, -1.0, 1.0)
    says = np.where(np.random.default_rng(0).uniform(size=3000) < 0.9, 1, 0.1)  # a tenth says little
    cells = np.digitize(outward[:, 0], [-0.4, 0.4]).astype(np.int64) if n_tiles == 3 else None
    for side in (1, -1):
        normals = side * expected[:, None] * outward
        signs, are_doubtful = sides(outward, normals, says[:, None] * normals, cells=cells)
        np.testing.assert_array_equal(signs, side * expected)
        assert not are_doubtful.any()


def test_small_pieces_have_the_side_of_their_volume(
    service: gramian.dask.Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, outward = grains(90, per_axis=4)
    for limit in ("MAX_COARSE", "LEAST_COARSE"):
        monkeypatch.setattr(f"gramian.dask.cells.thinning.{limit}", 192)  # three points of each
    (found,) = dask.compute(service.tiles(points, n_tiles=3).normals())
    cosines = (found.normals * outward).sum(axis=1)
    assert np.count_nonzero(cosines < 0) == 0
    assert "uncertain_orientation" not in found.reasons


@pytest.fixture
def service() -> gramian.dask.Service:
    return gramian.dask.connect()


@pytest.mark.parametrize(("n_coarse", "are_doubtful"), [(3, True), (40, False)])
def test_sides_that_few_coarse_points_choose_are_doubtful(n_coarse: int, are_doubtful: bool) -> None:
    points, outward = ring(4000, 1 / 30)
    rows = np.linspace(0, 3999, n_coarse).astype(np.int64)
    for side in (1, -1):
        signs, doubtful = sides(points, side * outward, side * outward, rows)
        assert (signs == 1).all()  # as the function says: so slim a ring has almost no volume
        assert (doubtful == are_doubtful).all()


def test_sides_of_which_the_function_says_both_are_doubtful() -> None:
    points, outward = ring(4000, 1 / 30)
    normals = np.where(points[:, :1] > 0.1, -1, 1) * outward
    signs, are_doubtful = sides(points, normals, normals)
    np.testing.assert_array_equal(signs, np.where(points[:, 0] > 0.1, -1, 1))  # its volume is positive
    assert are_doubtful.all()


def test_pieces_inside_of_another_are_not_turned_by_their_volume() -> None:
    outer, inner = sphere(4000), sphere(1000, seed=1)
    points, normals = np.concatenate([outer, inner / 2]), np.concatenate([outer, -inner])  # a shell, hollow
    signs, are_doubtful = sides(points, normals, normals)
    assert (signs == 1).all()
    assert not are_doubtful.any()
    few = np.concatenate([np.arange(0, 4000, 50), [4000, 4500]])
    assert sides(points, normals, normals, few)[1].tolist() == [False] * 4000 + [True] * 1000


def test_a_few_points_on_a_surface_are_not_doubtful() -> None:
    outer = sphere(4000)
    points = np.concatenate([outer, 1.3 * outer[:9]])
    across = np.roll(outer[:9], 1, axis=1)  # they share no edge with the others
    normals = np.concatenate([outer, across])
    assert not sides(points, normals, normals)[1].any()


def test_surfaces_that_touch_keep_their_sides() -> None:
    # One sphere lies above the other. Where they touch their normals are opposite: joined there, one of them
    # would be inside out.
    upper, lower = sphere(3000), sphere(3000, seed=1)
    points, normals = np.concatenate([upper, lower + np.array([0, 0, 2.0])]), np.concatenate([upper, lower])
    signs, are_doubtful = sides(points, normals, normals)
    assert (signs == 1).all()
    assert not are_doubtful.any()
