"""Arguments of clouds in tiles, and the replicas that answer."""

from __future__ import annotations

from typing import Any

import dask
import dask.array as da
import httpx
import numpy as np
import pytest

import gramian
import gramian.dask
from gramian.dask.cells import parts, plan
from gramian.dask.cells.parts import Part, Reach, nearest
from gramian.tiles import replicas
from gramian.wire.tensors import Array


@pytest.fixture
def service() -> gramian.dask.Service:
    return gramian.dask.connect()


@pytest.fixture(autouse=True)
def _one_thread() -> Any:
    with dask.config.set(scheduler="sync"):
        yield


def sphere(n: int, seed: int = 0) -> Array:
    points = np.random.default_rng(seed).normal(size=(n, 3))
    unit: Array = points / np.linalg.norm(points, axis=1, keepdims=True)
    return unit


def masked(array: Any, at: Any) -> Any:
    found = np.ma.array(array, mask=np.zeros(np.shape(array), dtype=bool))
    found[at] = np.ma.masked
    return found


def with_nan(array: Array, at: Any) -> Array:
    found = array.copy()
    found[at] = np.nan
    return found


POINTS, VALUES = sphere(600), np.arange(600.0)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (masked(POINTS, (401, 2)), r"points\[401, 2\] is masked"),
        (with_nan(POINTS, (401, 2)), r"points\[401, 2\] is nan"),
        (POINTS + 1j, "complex"),
        (POINTS > 0, "bool"),
    ],
)
@pytest.mark.parametrize("in_blocks", [False, True])
def test_points_that_are_no_numbers_are_refused_by_their_place(points: Any, message: str, in_blocks: bool) -> None:
    given = da.from_array(points, chunks=(250, 3)) if in_blocks else points
    with pytest.raises((TypeError, ValueError), match=message):
        gramian.dask.connect().tiles(given, n_tiles=2)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (masked(VALUES, 401), r"values\[401\] is masked"),
        (with_nan(VALUES, 401), r"values\[401\] is nan"),
        (VALUES + 1j, "complex"),
    ],
)
@pytest.mark.parametrize("in_blocks", [False, True])
def test_values_that_are_no_numbers_are_refused_by_their_place(
    service: gramian.dask.Service, values: Any, message: str, in_blocks: bool
) -> None:
    tiles = service.tiles(da.from_array(POINTS, chunks=(250, 3)), n_tiles=2)
    given = da.from_array(values, chunks=250) if in_blocks else values
    kernel = gramian.Kernel("matern", length_scale=0.5)
    with pytest.raises((TypeError, ValueError), match=message):
        tiles.interpolate(given, POINTS[:9], kernel=kernel, alpha=1e-3).values.compute()


def test_blocks_may_be_empty(service: gramian.dask.Service, client: gramian.Client) -> None:
    points = POINTS[np.argsort(POINTS[:, 0])]
    chosen = da.from_array(points, chunks=(100, 3))
    chosen = chosen[chosen[:, 0] > 0.5]  # the first blocks have none of these points
    found = service.tiles(chosen, n_tiles=2).normals().normals.compute()
    expected = client.cloud(points[points[:, 0] > 0.5]).normals(solver="local").normals
    np.testing.assert_allclose(np.abs((found * expected).sum(axis=1)), 1, atol=1e-9)


def test_a_cloud_in_one_place_has_no_normals(service: gramian.dask.Service) -> None:
    (found,) = dask.compute(service.tiles(np.ones((20, 3)), n_tiles=1).normals())
    assert np.isnan(found.normals).all()
    assert (found.reasons != "").all()


def test_neighbours_are_the_same_however_many_are_held(monkeypatch: pytest.MonkeyPatch) -> None:
    part, places = Part(np.arange(600), POINTS), sphere(50, seed=1)
    radii = np.linspace(0.1, 0.5, 50)
    expected = nearest(part, places, Reach(40)), nearest(part, places, Reach(40), radii)
    monkeypatch.setattr(parts, "MAX_FOUND", 130)  # three places at once
    np.testing.assert_array_equal(nearest(part, places, Reach(40)), expected[0])
    np.testing.assert_array_equal(nearest(part, places, Reach(40), radii), expected[1])


def test_large_clouds_are_sampled_on_both_sides_of_what_alternates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "MAX_SAMPLE", 1000)
    rows = plan.sampled(1999)
    assert len(rows) == 1000
    assert (rows // 2 == np.arange(1000)).all()
    assert 400 < np.count_nonzero(rows % 2) < 600
    np.testing.assert_array_equal(rows, plan.sampled(1999))


def test_a_key_of_the_environment_is_in_no_task(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRAMIAN_API_KEY", "secret")
    assert gramian.dask.connect().replicas.api_key is None
    given = gramian.dask.connect(api_key="given").replicas
    assert given.api_key == "given"
    assert "given" not in repr(given)


def test_a_lost_machine_is_waited_for_seconds_and_then_asked_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replicas, "_silent", {})
    asked: list[str] = []

    def call(client: gramian.Client) -> str:
        http = client._connection.http
        assert http.timeout.connect == 10
        assert http.timeout.read == 300
        asked.append(http.base_url.host)
        if asked[-1] == "lost":
            raise httpx.ConnectTimeout("nobody there")
        return asked[-1]

    both = replicas.Replicas(("http://lost:1", "http://here:1"))
    assert [both.ask(0, call) for _ in range(3)] == ["here"] * 3
    assert asked == ["lost", "here", "here", "here"]
    monkeypatch.setattr(replicas, "_silent", {"http://lost:1": 0.0})  # the replica may be asked again
    both.ask(0, call)
    assert asked[-2:] == ["lost", "here"]
