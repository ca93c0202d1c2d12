"""Answers: the fit that they report can be sent back, and their `repr` is readable."""

from __future__ import annotations

import copy
import dataclasses
import errno
import os
import pickle
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from sent import CIRCLE, METHODS, OPERATORS, QUERYING, VALUES

import gramian
from gramian import Kernel, Surface
from gramian.answers import Answer
from gramian.answers.fit import operator_fit_used, surface_fit_used
from gramian.export import replace_file
from gramian.rest.types import UNSET, Unset
from gramian.wire.tensors import Members

every_method = pytest.mark.parametrize("method", QUERYING)
every_operator = pytest.mark.parametrize("method", OPERATORS)

NOISE = np.linspace(0.01, 0.02, 8)
QUERIES = [[1.0, 0.0], [0.6, 0.8]]

# Fits with all options. The service chooses absent ones.
FITS: dict[str, dict[str, Any]] = {
    "nothing": {},
    "word": {"kernel": "gauss"},
    "kernel": {"kernel": Kernel("matern", nu=3.5), "alpha": 1e-6},
    "wendland": {"kernel": {"family": "wendland", "smoothness": 6, "length_scale": 3}, "alpha": np.float32(0.25)},
    "interpolation": {"kernel": Kernel("inverse_multiquadric", length_scale=0.5), "alpha": 0, "solver": "dense"},
    "length scales": {"kernel": Kernel("matern", length_scales=[1.5, 0.1], variance=2), "alpha": 1e-6},
    "merged": {"kernel": "gauss", "alpha": 0, "duplicates": "merge"},
    "noise": {"kernel": "gauss", "noise_variances": NOISE},
    "noise alone": {"noise_variances": NOISE},
}
GEOMETRIES: dict[str, dict[str, Any]] = {
    "kernel": {"kernel": Kernel("gauss", length_scale=2)},
    "alpha": {"kernel": "gauss", "alpha": 1e-6, "model": "signature"},
    "length scales": {"kernel": Kernel("gauss", length_scales=[2, 1 / 3]), "alpha": 1e-8},
    "noise": {"noise_variances": NOISE},
}


@pytest.fixture(scope="module")
def cloud() -> Any:
    return gramian.Client().cloud(CIRCLE)


def ask(cloud: Any, method: str, **arguments: object) -> Any:
    return getattr(cloud, method)(**{**METHODS[method], "queries": QUERIES, **arguments})


def sparse(value: Any) -> list[Any]:
    """Returns the sparse matrices in a member."""
    return [matrix for matrix in (value if isinstance(value, list) else [value]) if hasattr(matrix, "tocsr")]


def assert_same(answer: Answer, other: Answer) -> None:
    for field in dataclasses.fields(answer):
        value, again = getattr(answer, field.name, None), getattr(other, field.name, None)
        for matrix, other_matrix in zip(sparse(value), sparse(again), strict=True):
            np.testing.assert_array_equal(matrix.toarray(), other_matrix.toarray())
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(value, again, err_msg=field.name)
    assert repr(answer) == repr(other)
    assert repr(answer.fit) == repr(other.fit)  # type: ignore[attr-defined]


@every_method
@pytest.mark.parametrize("fit", FITS.values(), ids=FITS.keys())
def test_the_fit_of_an_answer_repeats_it(cloud: Any, method: str, fit: dict[str, Any]) -> None:
    points = CIRCLE
    if "duplicates" in fit:
        points = np.vstack([CIRCLE[:-1], CIRCLE[:1]])
        cloud = gramian.Client().cloud(points)
    answer = ask(cloud, method, **fit)
    assert_same(answer, ask(cloud, method, **answer.fit))
    assert_same(answer, ask(cloud, method, **pickle.loads(pickle.dumps(answer)).fit))
    assert_same(answer, ask(cloud, method, **copy.deepcopy(answer).fit))


@every_operator
@pytest.mark.parametrize("geometry", GEOMETRIES.values(), ids=GEOMETRIES.keys())
@pytest.mark.parametrize("fit", [{}, FITS["noise"], FITS["kernel"]], ids=["nothing", "noise", "kernel"])
def test_so_it_does_with_a_geometry(cloud: Any, method: str, fit: dict[str, Any], geometry: dict[str, Any]) -> None:
    answer = ask(cloud, method, **fit, surface=geometry)
    assert_same(answer, ask(cloud, method, **fit, surface=Surface(**geometry)))
    assert_same(answer, ask(cloud, method, **answer.fit))


@every_operator
def test_so_it_does_with_a_geometry_of_another_cloud(cloud: Any, method: str) -> None:
    other = gramian.Client().cloud(1.5 * CIRCLE[:7])
    for geometry in [other, Surface(cloud=other, kernel="gauss", noise_variances=NOISE[:7])]:
        answer = ask(cloud, method, surface=geometry)
        assert (answer.diagnostics.surface or answer.diagnostics).cloud_id == other.id
        again = pickle.loads(pickle.dumps(answer.fit))
        assert_same(answer, ask(cloud, method, **again))


@every_operator
@pytest.mark.parametrize("as_mapping", [False, True])
def test_a_forgotten_cloud_of_a_geometry_is_posted_again(cloud: Any, method: str, as_mapping: bool) -> None:
    other = gramian.Client().cloud(1.75 * CIRCLE)
    httpx.delete(f"{os.environ['GRAMIAN_URL']}/v1/clouds/{other.id}").raise_for_status()
    ask(cloud, method, surface={"cloud": other} if as_mapping else other)


# A cloud for local solvers, for which eight points are too few.
MANY = 1.5 * np.column_stack([np.cos(np.arange(40) * np.pi / 20), np.sin(np.arange(40) * np.pi / 20)])


@pytest.mark.parametrize("method", [*OPERATORS, "normals", "curvatures"])
def test_so_it_does_where_nothing_but_neighbours_is_fitted(method: str) -> None:
    cloud = gramian.Client().cloud(MANY)
    said: list[dict[str, Any]] = [{"surface": {"model": "regression"}}, {"surface": {"solver": "local"}}]
    if method not in OPERATORS:
        said = [{"surface_model": "regression"}, {"solver": "local"}]
    elif not method.endswith("_matrix") or "sparse" in method:
        said += [
            {"solver": "local"},
            {"solver": "local", "surface": {"solver": "dense", "kernel": "gauss", "alpha": 1e-8}},
        ]
        said += [
            {
                "solver": "local",
                "surface": {"cloud": gramian.Client().cloud(1.01 * MANY), "model": "regression"},
            }
        ]
    given = {"values": MANY[:, 0]} if "values" in METHODS[method] else {}
    for arguments in said:
        answer = getattr(cloud, method)(**given, queries=MANY[:3], **arguments)
        again = getattr(cloud, method)(**given, queries=MANY[:3], **pickle.loads(pickle.dumps(answer)).fit)
        assert_same(answer, again)
        if method in OPERATORS:
            surface = answer.diagnostics.surface or answer.diagnostics
            solver = {"solver": arguments["solver"]} if "solver" in arguments else {}
            again = getattr(cloud, method)(**given, queries=MANY[:3], surface=surface, **solver)
            assert again.diagnostics.to_dict() == answer.diagnostics.to_dict()


@every_method
def test_the_diagnostics_of_an_answer_can_be_sent_back(cloud: Any, method: str) -> None:
    answer = ask(cloud, method, kernel="matern", alpha=1e-4)
    said = answer.diagnostics
    # Sparse matrices have only the fit of the surface.
    geometry = {"surface": said.surface or said} if method in OPERATORS else {}
    again = ask(cloud, method, kernel=said.kernel, alpha=said.alpha, solver=said.solver, **geometry)
    assert again.diagnostics.to_dict() == said.to_dict()


@every_operator
def test_the_diagnostics_of_a_fit_with_noise_do_not_say_all(cloud: Any, method: str) -> None:
    said = ask(cloud, method, noise_variances=NOISE).diagnostics
    surface = said.surface or said
    with pytest.raises(ValueError, match=r"^surface.alpha is absent from these diagnostics"):
        ask(cloud, method, surface=surface)
    for geometry in [Surface(alpha=surface.alpha), {"alpha": surface.alpha}]:
        with pytest.raises(ValueError, match=r"^surface.alpha is absent from these diagnostics"):
            ask(cloud, method, surface=geometry)
    with pytest.raises(ValueError, match=r"^alpha is absent from these diagnostics"):
        ask(cloud, method, kernel=said.kernel, alpha=said.alpha)


def test_given_hyperparameters_are_part_of_the_fit(cloud: Any) -> None:
    learned = {"noise_deviation": 0.01}
    said = {"diagnostics": cloud.normals().diagnostics.to_dict()}
    for used in [surface_fit_used, operator_fit_used]:
        assert "hyperparameters" not in used(Members({}, said, {"cloud": {"id": cloud.id}}))
        request = {"cloud": {"id": cloud.id}, "hyperparameters": learned}
        assert used(Members({}, said, request))["hyperparameters"] == learned


# Starts of a search.
SEARCHES: dict[str, dict[str, Any]] = {
    **{name: fit for name, fit in FITS.items() if name != "merged"},
    "mean": {"mean": "linear"},
    "refused": {"kernel": "gauss", "alpha": 1e-3, "duplicates": "refuse"},
}


@pytest.mark.parametrize("fit", SEARCHES.values(), ids=SEARCHES.keys())
def test_the_fit_of_a_selection_is_what_was_selected(cloud: Any, fit: dict[str, Any]) -> None:
    selected = cloud.select_model(VALUES, **fit)
    for again in [selected.fit, pickle.loads(pickle.dumps(selected)).fit, copy.deepcopy(selected).fit]:
        answer = cloud.posterior(VALUES, QUERIES, **again)
        assert answer.diagnostics.kernel == selected.kernel
        if selected.alpha is None:
            assert answer.diagnostics.alpha is UNSET
        else:  # the service keeps its ratio to the variance
            assert answer.diagnostics.alpha == pytest.approx(selected.alpha, rel=1e-15)
        if selected.mean_coefficients is None:
            assert answer.diagnostics.mean_coefficients is UNSET
        else:
            mean = selected.mean_coefficients
            np.testing.assert_allclose(answer.diagnostics.mean_coefficients, mean, rtol=1e-6, atol=1e-9)
        assert_same(answer, cloud.posterior(VALUES, QUERIES, **answer.fit))
    further = cloud.select_model(VALUES, **selected.fit)  # the search may continue from there
    assert further.score > selected.score - 1e-6 * abs(selected.score)


def test_the_noise_of_a_fit_stays_what_was_sent(cloud: Any) -> None:
    noise = NOISE.copy()
    answer = cloud.posterior(VALUES, noise_variances=noise, include="variances")
    noise[:] = 7
    np.testing.assert_array_equal(answer.fit["noise_variances"], NOISE)


def test_the_families_that_the_service_lists_can_be_sent(cloud: Any) -> None:
    for described in gramian.Client().kernels():
        for kernel in [described, described.family, described.family.value]:
            answer = cloud.interpolate(VALUES, kernel=kernel)
            assert answer.diagnostics.kernel.family is described.family


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("fit", [{}, {"noise_variances": NOISE}], ids=["alpha", "noise"])
def test_an_answer_shows_arrays_by_shape_and_nothing_that_is_absent(
    cloud: Any, method: str, fit: dict[str, Any]
) -> None:
    shown = repr(getattr(cloud, method)(**METHODS[method], **fit))
    assert "unset" not in shown.lower()
    assert "None" not in shown
    assert "<" not in shown
    assert "=array[" in shown or "csr_matrix[" in shown
    assert len(shown) < 3000


def test_representations_are_as_one_writes_them(cloud: Any) -> None:
    answer = cloud.interpolate(VALUES, QUERIES, kernel="gauss", alpha=0.5)
    assert repr(answer) == "Interpolation(values=array[2], solver='dense')"
    kernel = answer.diagnostics.kernel
    assert repr(kernel) == f"KernelUsed(family='gauss', variance=1.0, length_scale={kernel.length_scale})"
    for written in [
        Kernel("gauss", length_scale=2),
        Kernel("gauss", length_scales=[2]),
        Kernel("gauss", length_scales=range(1, 9)),
    ]:
        assert eval(repr(written), {"Kernel": Kernel}) == written
    assert repr(Surface(cloud=cloud, kernel=Kernel("wendland", smoothness=4), noise_variances=NOISE)) == (
        f"Surface(cloud=Cloud(id='{cloud.id[:8]}…', n_points=8, dimension=2), "
        "kernel=Kernel(family='wendland', smoothness=4), noise_variances=array[8])"
    )
    assert repr(gramian.rest.models.Kernel(family=gramian.KernelFamily.GAUSS)) == "Kernel(family='gauss')"
    for said in [*gramian.Client().kernels(), cloud.description, gramian.Client().version(), gramian.Client()]:
        assert "unset" not in repr(said).lower()
    with pytest.raises(gramian.Problem) as caught:
        cloud.normals(alpha=-1)
    assert "unset" not in repr(caught.value).lower()
    assert repr(Unset()) == "UNSET"  # on its own it is shown


def test_a_full_disk_leaves_an_older_file_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    older = tmp_path / "mesh.ply"
    older.write_bytes(b"older")
    older.chmod(0o640)
    link = tmp_path / "link.ply"
    link.symlink_to("mesh.ply")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left"):
            replace_file(link, b"newer")
    assert older.read_bytes() == b"older"
    replace_file(link, b"newer")
    assert (link.is_symlink(), older.read_bytes(), older.stat().st_mode & 0o777) == (True, b"newer", 0o640)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.ply", "mesh.ply"]
