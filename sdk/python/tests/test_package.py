"""The package against the server at GRAMIAN_URL."""

from __future__ import annotations

import asyncio
import copy
import dataclasses
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path

import httpx
import numpy as np
import pytest
import scipy.sparse

import gramian
from gramian import Cloud, InterpolationBatch, Kernel, KernelFamily, PosteriorBatch, Surface
from gramian.answers import Answer, Data
from gramian.rest import models
from gramian.rest.api.geometry import compute_normals
from gramian.rest.models import CloudInput, NormalsRequest, NormalsResponse
from gramian.wire.tensors import Array, Format

GAUSS = Kernel(family=KernelFamily.GAUSS, length_scale=2.0)

# Every operation with all its options. The second query has no normal. The values are x².
QUERIES = [[1.0, 0.0], [0.0, 0.0]]
OPERATIONS: dict[str, Callable[[Cloud], object]] = {
    "interpolate": lambda cloud: cloud.interpolate(squares(cloud), QUERIES, derivatives=2, kernel=GAUSS),
    "posterior": lambda cloud: cloud.posterior(
        squares(cloud),
        QUERIES,
        include=["variances", "observation_variances", "covariance", "gradients", "log_marginal_likelihood"],
        kernel={"family": "gauss", "length_scale": 2.0},
        alpha=1e-6,
    ),
    "interpolate_batch": lambda cloud: cloud.interpolate_batch(
        lists(cloud), QUERIES, derivatives=2, std=True, mean="linear", kernel=GAUSS
    ),
    "posterior_batch": lambda cloud: cloud.posterior_batch(
        lists(cloud),
        QUERIES,
        include=["variances", "covariance", "gradients", "gradient_variances", "log_marginal_likelihood"],
        samples={"count": 4, "seed": 1},
        quantiles=[0.1, 0.5, 0.9],
        threshold=0.5,
        mean="constant",
        kernel=GAUSS,
        alpha=1e-6,
    ),
    "posterior_batch of one list": lambda cloud: cloud.posterior_batch(
        lists(cloud)[:1], QUERIES[:1], include="log_marginal_likelihood", samples=1, quantiles=[0.5], kernel=GAUSS
    ),
    "select_model": lambda cloud: cloud.select_model(
        np.sin(3 * squares(cloud)),
        vary=[
            {"parameter": "length_scales", "axis": 0, "min": 0.1, "max": 10},
            {"parameter": "nu", "min": 0.5, "max": 2.5},
        ],
        families=["matern", "gauss"],
        kernel={"family": "matern", "length_scales": [1, 2]},
        mean="linear",
        seed=1,
    ),
    "select_model with noise": lambda cloud: cloud.select_model(
        squares(cloud), noise_variances=np.linspace(0.1, 0.2, cloud.n_points)
    ),
    "posterior with noise": lambda cloud: cloud.posterior(
        squares(cloud), noise_variances=np.linspace(0.1, 0.2, cloud.n_points), include=["variances"]
    ),
    "normals": lambda cloud: cloud.normals(
        QUERIES, kernel=GAUSS, surface_model="signature", orientation="gradient", solver=None
    ),
    "curvatures": lambda cloud: cloud.curvatures(QUERIES, kernel=GAUSS, alpha=0),
    "normals nowhere": lambda cloud: cloud.normals([[0, 0]], kernel=GAUSS, alpha=0),
    "curvatures nowhere": lambda cloud: cloud.curvatures([[0, 0]], kernel=GAUSS, alpha=0),
    "gradients nowhere": lambda cloud: cloud.surface_gradient(squares(cloud), [[0, 0]], kernel=GAUSS, std=True),
    "matrices nowhere": lambda cloud: cloud.surface_gradient_matrix([[0, 0]], kernel=GAUSS),
    "matrix nowhere": lambda cloud: cloud.laplace_beltrami_matrix([[0, 0]], kernel=GAUSS),
    "sparse matrices nowhere": lambda cloud: cloud.surface_gradient_sparse_matrix([[0, 0]], kernel=GAUSS),
    "sparse matrix nowhere": lambda cloud: cloud.laplace_beltrami_sparse_matrix([[0, 0]], kernel=GAUSS),
    "surface_gradient": lambda cloud: cloud.surface_gradient(squares(cloud), QUERIES, kernel=GAUSS),
    "surface_gradient_matrix": lambda cloud: cloud.surface_gradient_matrix(QUERIES, kernel=GAUSS),
    "laplace_beltrami": lambda cloud: cloud.laplace_beltrami(squares(cloud), QUERIES, kernel=GAUSS),
    "laplace_beltrami_matrix": lambda cloud: cloud.laplace_beltrami_matrix(QUERIES, kernel=GAUSS),
    "std": lambda cloud: cloud.curvatures(QUERIES, kernel=GAUSS, alpha=0, std=True),
    "deviations of normals": lambda cloud: cloud.normals(QUERIES, include="std"),
    "surface_gradient_sparse_matrix": lambda cloud: cloud.surface_gradient_sparse_matrix(QUERIES, kernel=GAUSS),
    "laplace_beltrami_sparse_matrix": lambda cloud: cloud.laplace_beltrami_sparse_matrix(QUERIES, kernel=GAUSS),
    "another surface": lambda cloud: cloud.laplace_beltrami(
        squares(cloud), kernel=GAUSS, surface=Surface(cloud=cloud, alpha=1e-8, noise_variances=None)
    ),
}


def squares(cloud: Cloud) -> Array:
    assert cloud.points is not None
    return np.square(cloud.points[:, 0])


def lists(cloud: Cloud) -> Array:
    assert cloud.points is not None
    return np.vstack([squares(cloud), cloud.points.T])


def members(answer: object) -> dict[str, object]:
    assert dataclasses.is_dataclass(answer)
    return {field.name: getattr(answer, field.name, None) for field in dataclasses.fields(answer)}


@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS.keys())
def test_safetensors_and_json_give_equal_answers(operation: Callable[[Cloud], object], circle: Array) -> None:
    formats: list[Format] = ["safetensors", "json"]
    binary, text = (operation(gramian.Client(format=format_).cloud(circle)) for format_ in formats)
    assert_equal(members(binary), members(text))


def assert_equal(binary: dict[str, object], text: dict[str, object]) -> None:
    assert binary.keys() == text.keys()
    for name, value in binary.items():
        other = text[name]
        if isinstance(value, np.ndarray):
            assert isinstance(other, np.ndarray)
            assert (value.shape, value.dtype) == (other.shape, other.dtype), name
            np.testing.assert_array_equal(value, other, err_msg=name)
            assert not value.flags.writeable
            assert not other.flags.writeable
        elif name in ["matrix", "matrices"]:
            for matrix, other_matrix in zip(*(v if isinstance(v, list) else [v] for v in (value, other)), strict=True):
                assert isinstance(matrix, scipy.sparse.csr_matrix)
                assert (matrix.shape, matrix.dtype) == (other_matrix.shape, other_matrix.dtype)
                assert (matrix != other_matrix).nnz == 0
        elif name == "fit":
            assert repr(value) == repr(other)
        elif isinstance(value, Answer | Data):
            assert_equal(members(value), members(other))
        else:
            assert value == other, name


def test_answers_have_the_documented_shapes(client: gramian.Client) -> None:
    rng = np.random.default_rng(1)
    points = rng.normal(size=(50, 3))
    cloud = client.cloud(points / np.linalg.norm(points, axis=1, keepdims=True))
    queries = cloud.points[:7] if cloud.points is not None else None
    curvatures = cloud.curvatures(queries)
    assert curvatures.principal_curvatures.shape == (7, 2)
    assert curvatures.principal_directions.shape == (7, 2, 3)
    assert curvatures.mean_curvatures.shape == curvatures.gaussian_curvatures.shape == (7,)
    assert curvatures.normals.shape == (7, 3)
    assert len(curvatures.surface_models) == 7
    assert cloud.laplace_beltrami_matrix(queries).matrix.shape == (7, 50)
    assert cloud.surface_gradient_matrix(queries).matrices.shape == (3, 7, 50)
    answer = cloud.interpolate(np.ones(50), queries, derivatives=2)
    assert (answer.gradients.shape, answer.hessians.shape) == ((7, 3), (7, 3, 3))
    posterior = cloud.posterior(np.ones(50), queries, include=[gramian.PosteriorQuantity.COVARIANCE], alpha=0.1)
    assert posterior.covariance.shape == (7, 7)
    assert not hasattr(posterior, "variances")


def test_measured_values_need_no_parameters(client: gramian.Client) -> None:
    random = np.random.default_rng(3)
    z = (2 * np.arange(300) + 1) / 300 - 1
    turn = np.arange(300) * np.pi * (3 - np.sqrt(5))
    points = np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])
    sphere, values = client.cloud(points), 20 + z + 0.02 * random.normal(size=300)
    answer = sphere.interpolate(values, points[:40], derivatives=2, std=True)
    assert answer.gradient_std.shape == (40, 3)
    assert answer.hessian_std.shape == (40, 3, 3)
    assert np.all(np.abs(answer.values - 20 - z[:40]) < 4 * answer.value_std)
    assert answer.fit["mean"] == "constant"
    laplacian = sphere.laplace_beltrami(values, std=True)
    within = np.abs(laplacian.laplacians + 2 * z) < 1.96 * laplacian.laplacian_std
    assert within.mean() > 0.88
    gradient = sphere.surface_gradient(values, include="std", mean="linear")
    assert gradient.gradient_std.shape == (300, 3)
    assert not hasattr(sphere.surface_gradient(values, kernel="matern"), "gradient_std")


def test_a_batch_answers_what_each_list_alone_does(client: gramian.Client) -> None:
    random = np.random.default_rng(4)
    points, queries = random.uniform(-1, 1, size=(60, 2)), random.uniform(-1, 1, size=(7, 2))
    cloud = client.cloud(points)
    values = np.stack([np.sin(3 * points[:, 0]), points[:, 1] + 2, 5 * points[:, 0] * points[:, 1]])
    values += 0.05 * random.normal(size=(3, 60))
    for fit in [gramian.ValuesFit(mean="linear"), gramian.ValuesFit(kernel=GAUSS, alpha=1e-4), gramian.ValuesFit()]:
        answer = cloud.interpolate_batch(values, queries, derivatives=2, std=True, **fit)
        assert_shapes(answer, values=(3, 7), gradients=(3, 7, 2), hessians=(3, 7, 2, 2))
        assert_shapes(answer, value_std=(7,), gradient_std=(7, 2), hessian_std=(7, 2, 2))
        for i, of_one in enumerate(values):
            single = cloud.interpolate(of_one, queries, derivatives=2, std=True, **answer.fit)
            assert_row(answer, i, single, "values", "gradients", "hessians")
            for name in ["value_std", "gradient_std", "hessian_std"]:
                np.testing.assert_allclose(getattr(answer, name), getattr(single, name), rtol=1e-9, err_msg=name)
            mean = single.diagnostics.mean_coefficients
            if isinstance(mean, gramian.Unset):
                assert answer.mean_coefficients is None
            else:
                assert_shapes(answer, mean_coefficients=(3, len(mean)))
                assert answer.mean_coefficients is not None
                np.testing.assert_allclose(answer.mean_coefficients[i], mean, rtol=1e-9)


def test_so_does_a_batch_of_posteriors(client: gramian.Client) -> None:
    random = np.random.default_rng(5)
    points, queries = random.uniform(-1, 1, size=(50, 2)), random.uniform(-1, 1, size=(6, 2))
    cloud = client.cloud(points)
    values = np.stack([np.sin(3 * points[:, 0]), np.cos(points[:, 1])]) + 0.05 * random.normal(size=(2, 50))
    answer = cloud.posterior_batch(
        values, queries, include=list(gramian.PosteriorQuantity), samples=4, quantiles=[0.1, 0.5, 0.9], threshold=0.5
    )
    assert_shapes(answer, means=(2, 6), gradients=(2, 6, 2), samples=(2, 4, 6), quantiles=(2, 3, 6))
    assert_shapes(answer, exceedance_probabilities=(2, 6), log_marginal_likelihoods=(2,), mean_coefficients=(2, 1))
    assert_shapes(answer, variances=(6,), observation_variances=(6,), covariance=(6, 6), gradient_variances=(6, 2))
    for i, of_one in enumerate(values):
        single = cloud.posterior(
            of_one,
            queries,
            include=list(gramian.PosteriorQuantity),
            quantiles=[0.1, 0.5, 0.9],
            threshold=0.5,
            **answer.fit,
        )
        assert_row(answer, i, single, "means", "gradients", "quantiles", "exceedance_probabilities")
        for name in ["variances", "observation_variances", "covariance", "gradient_variances"]:
            np.testing.assert_allclose(getattr(answer, name), getattr(single, name), rtol=1e-9, err_msg=name)
        assert answer.log_marginal_likelihoods[i] == pytest.approx(single.log_marginal_likelihood, rel=1e-9)
    plain = cloud.posterior_batch(values, queries, kernel=GAUSS)
    assert [name for name, value in members(plain).items() if value is not None] == [
        "positions",
        "data",
        "means",
        "diagnostics",
        "fit",
    ]


def assert_shapes(answer: object, **shapes: tuple[int, ...]) -> None:
    assert {name: getattr(answer, name).shape for name in shapes} == shapes


def assert_row(answer: object, i: int, single: object, *names: str) -> None:
    for name in names:
        np.testing.assert_allclose(getattr(answer, name)[i], getattr(single, name), atol=1e-9, rtol=1e-9, err_msg=name)


def test_batches_are_dense(client: gramian.Client, circle: Array) -> None:
    cloud = client.cloud(circle)
    methods: list[Callable[..., InterpolationBatch | PosteriorBatch]] = [cloud.interpolate_batch, cloud.posterior_batch]
    for method in methods:
        with pytest.raises(gramian.Problem) as caught:
            method(circle.T, solver="local")
        assert (caught.value.slug, caught.value.pointer) == ("unsupported-by-solver", "/solver")
        assert method(circle.T, solver="auto").diagnostics.solver is gramian.SolverUsed.DENSE


def test_a_selection_finds_what_explains_values(client: gramian.Client) -> None:
    random = np.random.default_rng(6)
    points = random.uniform(-1, 1, size=(70, 2))
    values = np.sin(4 * points[:, 0]) + 0.1 * random.normal(size=70)  # independent of the second coordinate
    cloud = client.cloud(points)
    vary: gramian.Bounds = {"length_scales": (0.05, 50), "variance": (0.01, 100), "alpha": (1e-6, 1)}
    found = cloud.select_model(values, vary=vary, families=["gauss", "matern"], kernel="gauss", alpha=1e-2)
    assert found.converged
    assert found.evaluations > 1
    assert not isinstance(found.kernel.length_scales, gramian.Unset)
    assert found.kernel.length_scales[0] < 1 < 5 < found.kernel.length_scales[1]
    assert found.alpha is not None
    assert np.sqrt(found.alpha) == pytest.approx(0.1, rel=0.3)
    assert found.mean_coefficients is None
    assert_shapes(found, score_gradient=(3,))
    assert_shapes(found.alpha_path, alphas=found.alpha_path.scores.shape)
    assert_shapes(found.leave_one_out, means=(70,), variances=(70,), log_predictive_densities=(70,))
    assert np.all(np.diff(found.alpha_path.alphas) > 0)
    assert np.nanmax(found.alpha_path.scores) <= found.score + 1e-6
    assert [entry.family for entry in found.families] == [KernelFamily.GAUSS, KernelFamily.MATERN]
    assert found.score == max(entry.score for entry in found.families if isinstance(entry.score, float))
    assert found.diagnostics.alpha == 1e-2
    answer = cloud.posterior(values, include="log_marginal_likelihood", **found.fit)
    assert answer.log_marginal_likelihood == pytest.approx(found.score, rel=1e-9)
    errors = (values - found.leave_one_out.means) / np.sqrt(found.leave_one_out.variances)
    densities = -0.5 * errors**2 - 0.5 * np.log(2 * np.pi * found.leave_one_out.variances)
    np.testing.assert_allclose(found.leave_one_out.log_predictive_densities, densities, rtol=1e-9)
    others = client.cloud(points[1:]).posterior(values[1:], points[:1], include="observation_variances", **found.fit)
    assert others.means[0] == pytest.approx(found.leave_one_out.means[0], abs=1e-6)
    assert others.observation_variances[0] == pytest.approx(found.leave_one_out.variances[0], rel=1e-6)


def test_a_selection_tries_every_smoothness_within_bounds(client: gramian.Client) -> None:
    random = np.random.default_rng(7)
    points = random.uniform(-1, 1, size=(40, 2))
    values = np.abs(points[:, 0]) + 0.05 * random.normal(size=40)
    cloud = client.cloud(points)
    for criterion in gramian.SelectionCriterion:
        found = cloud.select_model(
            values, vary={"nu": (0.5, 2.5), "length_scale": (0.1, 10)}, kernel="matern", alpha=0.01, criterion=criterion
        )
        assert [entry.nu for entry in found.families] == [0.5, 1.5, 2.5]
        assert np.isnan(found.score_gradient).tolist() == [True, False]
        if criterion is gramian.SelectionCriterion.LEAVE_ONE_OUT:
            assert found.score == pytest.approx(found.leave_one_out.log_predictive_densities.sum(), rel=1e-9)
    noise = cloud.select_model(values, noise_variances=np.full(40, 0.0025))
    assert (noise.alpha, noise.alpha_path.alphas.shape, noise.alpha_path.scores.shape) == (None, (0,), (0,))
    assert "alpha" not in noise.fit


def test_a_selection_is_refused_by_name(client: gramian.Client, circle: Array) -> None:
    cloud = client.cloud(circle)
    refusals: dict[str, Callable[[], object]] = {
        "/vary/0": lambda: cloud.select_model(circle[:, 0], vary={"alpha": (1, 0.1)}),
        "/vary/1": lambda: cloud.select_model(circle[:, 0], vary={"nu": (0.5, 1.5), "epsilon": (0.1, 1)}),
        "/restarts": lambda: cloud.select_model(circle[:, 0], restarts=101),
        "/families/1": lambda: cloud.select_model(circle[:, 0], families=["gauss", "gauss"]),
        "/duplicates": lambda: cloud.select_model(circle[:, 0], duplicates="merge"),
        "/vary/0/axis": lambda: cloud.select_model(
            circle[:, 0], vary=[{"parameter": "alpha", "axis": 0, "min": 0.1, "max": 1}]
        ),
        "/solver": lambda: cloud.select_model(circle[:, 0], solver="local"),
    }
    for pointer, refused in refusals.items():
        with pytest.raises(gramian.Problem) as caught:
            refused()
        assert caught.value.pointer == pointer


def test_an_entry_without_meaning_is_nan(client: gramian.Client, circle: Array) -> None:
    answer = client.cloud(circle).curvatures(QUERIES, kernel=GAUSS, alpha=0)
    np.testing.assert_allclose(answer.principal_curvatures[0], 1, atol=1e-4)
    assert np.isnan(answer.principal_curvatures[1]).all()
    assert np.isnan(answer.normals[1]).all()
    assert answer.flags[0].reason is gramian.FlagReason.VANISHING_GRADIENT


def test_deviations_are_there_where_they_are_asked_for(client: gramian.Client) -> None:
    rng = np.random.default_rng(2)
    points = rng.normal(size=(400, 3))
    points *= (1 + 0.01 * rng.normal(size=(400, 1))) / np.linalg.norm(points, axis=1, keepdims=True)
    cloud = client.cloud(points)
    queries = np.vstack([points[:7], [[50.0, 0.0, 0.0]]])
    answer = cloud.curvatures(queries, std=True)
    deviations = [answer.normal_std, answer.mean_curvature_std, answer.gaussian_curvature_std]
    for numbers, of_what in zip(deviations, [answer.mean_curvatures] * 3, strict=True):
        assert numbers.shape == (8,)
        assert (np.isnan(of_what) <= np.isnan(numbers)).all()
        assert (numbers[:7] > 0).all()
    assert answer.principal_curvature_std.shape == (8, 2)
    errors = np.abs(answer.mean_curvatures[:7] - 1) / answer.mean_curvature_std[:7]
    assert np.median(errors) < 2
    assert answer.diagnostics.solver is gramian.SolverUsed.LOCAL
    assert answer.diagnostics.noise_deviation == pytest.approx(0.01, rel=0.3)
    normals = cloud.normals(queries, include="std")
    assert normals.normal_std.shape == (8,)
    plain = cloud.curvatures(queries)
    assert not any(hasattr(plain, name) for name in ("normal_std", "principal_curvature_std", "mean_curvature_std"))
    assert not hasattr(cloud.normals(queries), "normal_std")


@pytest.mark.parametrize("format_", ["safetensors", "json"])
def test_sparse_matrices_are_those_of_scipy(format_: Format) -> None:
    angles = np.arange(200) * np.pi / 100
    cloud = gramian.Client(format=format_).cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
    laplace = cloud.laplace_beltrami_sparse_matrix(solver="local")
    assert laplace.matrix.shape == (200, 200)
    assert laplace.matrix.nnz < 200 * 30
    np.testing.assert_allclose(laplace.matrix @ np.cos(3 * angles), -9 * np.cos(3 * angles), atol=1e-2)
    gradient = cloud.surface_gradient_sparse_matrix(cloud.points[:5] if cloud.points is not None else None)
    assert [matrix.shape for matrix in gradient.matrices] == [(5, 200), (5, 200)]
    tangents = np.array([-np.sin(angles[:5]), np.cos(angles[:5])])
    found = np.array([matrix @ np.sin(angles) for matrix in gradient.matrices])
    np.testing.assert_allclose(found, np.cos(angles[:5]) * tangents, atol=1e-4)
    assert repr(laplace).startswith("LaplaceBeltramiSparseMatrix(matrix=csr_matrix[200, 200], ")


def test_without_scipy_an_error_says_what_is_missing(circle: Array) -> None:
    program = f"""
import sys
sys.modules["scipy"] = None  # as if it were not installed
import gramian
cloud = gramian.Client().cloud({circle.tolist()})
for method in [cloud.laplace_beltrami_sparse_matrix, cloud.surface_gradient_sparse_matrix]:
    try:
        method()
    except ModuleNotFoundError as error:
        print(error.name, error)
"""
    printed = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout
    message = "sparse matrices are those of SciPy, which is not installed: pip install 'gramian[scipy]'"
    assert printed == f"scipy {message}\n" * 2


def test_scipy_is_imported_where_it_is_needed() -> None:
    program = "import sys, gramian; print('scipy' in sys.modules)"
    assert (
        subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout == "False\n"
    )


def test_without_safetensors_json_is_used(circle: Array) -> None:
    program = f"""
import sys
sys.modules["safetensors"] = None  # as if it were not installed
import gramian
client = gramian.Client()
assert client._connection.format == "json"
print(client.cloud({circle.tolist()}).curvatures([[1, 0]]).principal_curvatures.shape)
try:
    gramian.Client(format="safetensors").cloud([[1, 0]])
except ModuleNotFoundError as error:
    print(error)
"""
    printed = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout
    assert printed == "(1, 1)\nsafetensors is not installed: pip install 'gramian[safetensors]'\n"


@pytest.mark.parametrize("format_", ["safetensors", "json"])
def test_a_forgotten_cloud_is_posted_again(format_: Format, circle: Array) -> None:
    client = gramian.Client(format=format_)
    cloud = client.cloud(circle, normals=circle)
    expected = cloud.normals().normals
    forget(cloud)
    np.testing.assert_array_equal(cloud.normals().normals, expected)
    assert cloud.id in {known.id for known in client.clouds()}


def test_a_file_is_a_cloud(client: gramian.Client, tmp_path: Path) -> None:
    points = np.array([[0.0, 0.0, 1.0], [0.0, 3.0, 1.0], [2.0, 0.5, 0.25]])
    names = ["x", "y", "z", "nx", "ny", "nz"]
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    head = "\n".join([*lines, *(f"property double {name}" for name in names), "end_header", ""])
    file = head.encode() + np.hstack([points, points]).astype("<f8").tobytes()
    path = tmp_path / "scan.PLY"
    path.write_bytes(file)
    expected = client.cloud(points, normals=points)
    paths: list[Path | str] = [path, str(path)]
    for cloud in map(client.cloud, paths):
        assert cloud.id == expected.id
        np.testing.assert_array_equal(cloud.points, points)
    cloud = client.cloud(file)
    assert (cloud.id, cloud.n_points, cloud.points) == (expected.id, 3, None)
    forget(cloud)
    np.testing.assert_array_equal(cloud.normals().normals, expected.normals().normals)
    with pytest.raises(TypeError, match="a file has its own"):
        client.cloud(path, normals=points)
    with pytest.raises(gramian.Problem, match="at most 0 fit"):
        client.cloud(head.encode())
    with pytest.raises(FileNotFoundError):
        client.cloud("nowhere.ply")


def test_what_is_left_out_of_a_file_is_said(client: gramian.Client, tmp_path: Path) -> None:
    fields = ["FIELDS x y z", "SIZE 4 4 4", "TYPE F F F", "WIDTH 2", "HEIGHT 1", "DATA ascii"]
    path = tmp_path / "scan.pcd"
    path.write_text("\n".join(["VERSION 0.7", *fields, "nan nan nan", "1 2 3", ""]))
    with pytest.warns(UserWarning, match="left out without a position: 1 of 2 points") as warned:
        cloud = client.cloud(path)
    assert warned[0].filename == __file__
    np.testing.assert_array_equal(cloud.points, [[1.0, 2.0, 3.0]])
    path = tmp_path / "scan.xyz"
    path.write_text("1 2 3\n4 5\n")
    with pytest.raises(ValueError, match="line 2 has 2 cells"):
        client.cloud(path)


def test_the_cloud_of_a_geometry_is_posted_again(client: gramian.Client, circle: Array) -> None:
    nodes, surface = client.cloud(circle), client.cloud(1.5 * circle)
    geometry = Surface(cloud=surface, kernel={"family": "gauss", "length_scale": 3.0}, alpha=0.0)
    expected = nodes.laplace_beltrami(squares(nodes), surface=geometry)
    assert expected.laplacians.shape == (8,)
    assert isinstance(expected.diagnostics.surface, gramian.Diagnostics)
    assert expected.diagnostics.surface.cloud_id == surface.id
    for forgotten in [[nodes], [surface], [nodes, surface]]:
        for cloud in forgotten:
            forget(cloud)
        answer = nodes.laplace_beltrami(squares(nodes), surface=geometry)
        np.testing.assert_array_equal(answer.laplacians, expected.laplacians)


def test_the_cloud_of_a_geometry_may_be_of_another_client(client: gramian.Client, circle: Array) -> None:
    surface = gramian.Client().cloud(1.25 * circle)
    forget(surface)
    answer = client.cloud(circle).laplace_beltrami_matrix(surface=Surface(cloud=surface))
    assert answer.matrix.shape == (8, 8)


def test_a_listed_cloud_cannot_be_posted_again(client: gramian.Client, circle: Array) -> None:
    made = client.cloud(3 * circle)
    [listed] = [cloud for cloud in client.clouds(page_size=1) if cloud.id == made.id]
    assert (listed.points, listed.description) == (None, made.description)
    np.testing.assert_array_equal(listed.normals().normals, made.normals().normals)
    forget(listed)
    with pytest.raises(gramian.UnknownCloud) as caught:
        listed.normals()
    assert (caught.value.status, caught.value.pointer) == (404, "/cloud/id")
    made.normals()  # posts the points again, for both
    listed.normals()


def forget(cloud: Cloud) -> None:
    """Deletes the cloud in the service, without its client."""
    httpx.delete(f"{os.environ['GRAMIAN_URL']}/v1/clouds/{cloud.id}").raise_for_status()


def test_a_deleted_cloud_may_be_deleted_again(client: gramian.Client, circle: Array) -> None:
    cloud = client.cloud(circle)
    cloud.delete()
    cloud.delete()


def test_points_are_kept_as_they_were_posted(client: gramian.Client, circle: Array) -> None:
    points = circle.copy()
    cloud = client.cloud(points)
    points[0] = 7
    assert cloud.points is not None
    np.testing.assert_array_equal(cloud.points, circle)
    with pytest.raises(ValueError, match="read-only"):
        cloud.points[0] = 7


def test_arrays_of_other_libraries_stay_their_own(client: gramian.Client, circle: Array) -> None:
    class Foreign:
        def __init__(self) -> None:
            self.numbers = circle.copy()

        def __array__(self, dtype: object = None, copy: bool | None = None) -> Array:
            return self.numbers

    foreign = Foreign()
    cloud = client.cloud(foreign)
    assert foreign.numbers.flags.writeable
    assert cloud.points is not None
    assert not np.shares_memory(cloud.points, foreign.numbers)


def test_a_refusal_has_pointer_and_remedy(client: gramian.Client, circle: Array) -> None:
    cloud = client.cloud(np.vstack([circle, circle[:1]]))
    with pytest.raises(gramian.Problem) as caught:
        cloud.interpolate(np.arange(9), kernel=GAUSS, alpha=0)
    problem = caught.value
    assert (problem.status, problem.slug, problem.point_indices) == (422, "duplicate-points", (0, 8))
    assert "set alpha" in problem.detail
    assert problem.pointer == "/cloud/id"
    first, place, request = str(problem).splitlines()
    assert first == f"422 duplicate-points: {problem.detail}"
    assert place == "  at /cloud/id: coincides with another point"
    assert request == f"  request {problem.request_id}"
    merged = cloud.interpolate(np.arange(9), kernel=GAUSS, alpha=0, duplicates="merge")
    assert merged.diagnostics.n_merged_duplicates == 1


def test_a_matrix_too_close_to_singular_says_which_alpha_helps(client: gramian.Client, circle: Array) -> None:
    cloud = client.cloud(circle)
    flat = Kernel(family=KernelFamily.GAUSS, length_scale=1e4)
    with pytest.raises(gramian.NotPositiveDefinite) as caught:
        cloud.posterior(np.ones(8), kernel=flat, alpha=0, include=["variances"])
    remedy = caught.value.minimum_alpha
    assert remedy is not None
    assert "set alpha to" in str(caught.value)
    cloud.posterior(np.ones(8), kernel=flat, alpha=remedy, include=["variances"])


@pytest.mark.parametrize("format_", ["safetensors", "json"])
def test_pointers_are_the_same_in_both_formats(format_: Format, circle: Array) -> None:
    cloud = gramian.Client(format=format_).cloud(circle)
    refusals: dict[str, Callable[[], object]] = {
        "/kernel/length_scale": lambda: cloud.normals(kernel={"family": "gauss", "length_scale": -1.0}),
        "/kernel/nu": lambda: cloud.normals(kernel={"family": "gauss", "nu": 2.5}),
        "/alpha": lambda: cloud.interpolate(np.ones(8), alpha=-1),
        "/noise_variances/4": lambda: cloud.normals(noise_variances=np.arange(3, -5, -1)),
        "/surface/noise_variances/0": lambda: cloud.laplace_beltrami_matrix(
            surface=Surface(noise_variances=np.full(8, -1))
        ),
    }
    for pointer, refused in refusals.items():
        with pytest.raises(gramian.Problem) as caught:
            refused()
        assert caught.value.pointer == pointer


def test_wrong_shapes_and_numbers_are_refused_before_they_are_sent(client: gramian.Client, circle: Array) -> None:
    cloud = client.cloud(circle)
    with pytest.raises(ValueError, match=r"^queries must have the shape \[m, d\] = \[m, 2\], not \[2\]"):
        cloud.normals([1, 0])
    with pytest.raises(ValueError, match=r"^points\[1, 0\] is nan"):
        client.cloud([[0.0, 0.0], [np.nan, 0.0]])
    with pytest.raises(ValueError, match=r"^alpha is nan"):
        cloud.normals(alpha=float("nan"))


def test_arrays_of_any_layout_are_sent_right(client: gramian.Client, circle: Array) -> None:
    cloud = client.cloud(circle)
    rows: list[list[float]] = circle.tolist()
    layouts: list[list[list[float]] | Array] = [
        rows,
        circle.T.copy().T,
        np.repeat(circle, 2, axis=0)[::2],
        circle.astype(">f8"),
    ]
    assert {client.cloud(same).id for same in layouts} == {cloud.id}


def test_what_is_accepted_is_so_for_type_checkers(client: gramian.Client, circle: Array) -> None:
    cloud, other = client.cloud(circle), client.cloud(2 * circle)
    answer = cloud.posterior(range(8), kernel="gauss", alpha=np.float32(0.5), include="variances")
    said = answer.diagnostics
    cloud.posterior([0.5] * 8, kernel=said.kernel, alpha=said.alpha, solver=said.solver, include=["variances"])
    cloud.interpolate(np.arange(8), derivatives=np.int64(1), **answer.fit)
    cloud.normals(kernel=client.kernels()[0], alpha=np.array(0.5), surface_model="auto")
    cloud.curvatures(kernel={"family": "gauss", "length_scale": np.float32(2)}, alpha=Fraction(1, 2))
    cloud.normals(kernel=models.Kernel(family=KernelFamily.GAUSS), noise_variances=np.full(8, 0.1, dtype=np.float32))
    operator = cloud.laplace_beltrami_matrix(surface={"kernel": Kernel("gauss"), "alpha": np.int64(1)})
    cloud.laplace_beltrami_matrix(**operator.fit)
    cloud.laplace_beltrami(range(8), surface=other)
    assert not isinstance(operator.diagnostics.surface, gramian.Unset)
    cloud.surface_gradient(range(8), surface=operator.diagnostics.surface)
    fit: gramian.Fit = {"kernel": "matern", "alpha": 0}
    cloud.surface_gradient_matrix(surface=Surface(kernel="gauss", alpha=said.alpha), **fit)


def test_answers_and_problems_can_be_pickled_and_copied(client: gramian.Client, circle: Array) -> None:
    answer = client.cloud(circle).curvatures(QUERIES, kernel=GAUSS)
    for twin in [pickle.loads(pickle.dumps(answer)), copy.deepcopy(answer)]:
        np.testing.assert_array_equal(twin.normals, answer.normals)
        assert twin.diagnostics == answer.diagnostics
        assert twin.diagnostics.to_dict() == answer.diagnostics.to_dict()
        client.cloud(circle).curvatures(kernel=twin.diagnostics.kernel)
    with pytest.raises(gramian.Problem) as caught:
        client.cloud(circle).normals(alpha=-1)
    problem = pickle.loads(pickle.dumps(caught.value))
    assert (type(problem), str(problem)) == (type(caught.value), str(caught.value))


def test_a_client_may_be_shared_by_threads(client: gramian.Client, circle: Array) -> None:
    clouds = [client.cloud((1 + i) * circle) for i in range(8)]
    with ThreadPoolExecutor(8) as pool:
        radii = list(
            pool.map(lambda cloud: 1 / cloud.curvatures(kernel=cloud_kernel(cloud)).mean_curvatures[0], clouds)
        )
    np.testing.assert_allclose(radii, np.arange(1, 9), rtol=1e-3)


def cloud_kernel(cloud: Cloud) -> Kernel:
    assert cloud.points is not None
    return Kernel(family=KernelFamily.GAUSS, length_scale=2 * float(np.linalg.norm(cloud.points[0])))


def test_the_generated_client_serves_asyncio(client: gramian.Client, circle: Array) -> None:
    async def ask() -> object:
        async with client.rest as rest:
            return await compute_normals.asyncio(client=rest, body=NormalsRequest(cloud=CloudInput(id=cloud.id)))

    cloud = client.cloud(circle)
    answer = asyncio.run(ask())
    assert isinstance(answer, NormalsResponse)
    np.testing.assert_array_equal(np.array(answer.normals), cloud.normals().normals)


def test_a_server_without_keys_takes_any(circle: Array) -> None:
    assert gramian.Client(api_key="secret").cloud(circle).n_points == 8


@pytest.mark.parametrize("format_", ["safetensors", "json"])
def test_every_axis_may_have_a_length_scale_of_its_own(format_: Format, circle: Array) -> None:
    scales = np.array([2.0, 0.5])
    cloud, scaled = (gramian.Client(format=format_).cloud(points) for points in [circle, circle / scales])
    queries = np.array([[0.3, -0.2], [1.5, 0.1]])
    answer = cloud.interpolate(circle[:, 0], queries, derivatives=2, kernel=Kernel("matern", length_scales=scales))
    single = scaled.interpolate(circle[:, 0], queries / scales, derivatives=2, kernel=Kernel("matern", length_scale=1))
    np.testing.assert_allclose(answer.values, single.values, rtol=1e-9)
    np.testing.assert_allclose(answer.gradients * scales, single.gradients, atol=1e-9)
    used = answer.diagnostics.kernel
    assert (used.length_scale, used.length_scales) == (gramian.UNSET, [2.0, 0.5])
    again = cloud.interpolate(circle[:, 0], queries, kernel=used, alpha=answer.diagnostics.alpha)
    np.testing.assert_array_equal(again.values, answer.values)
    assert repr(used) == "KernelUsed(family='matern', variance=1.0, length_scales=[2.0, 0.5], nu=2.5)"
    refused: list[tuple[gramian.KernelLike, str]] = [
        (Kernel("gauss", length_scale=1, length_scales=scales), "/kernel/length_scales"),
        ({"family": "gauss", "length_scales": [1, 0]}, "/kernel/length_scales/1"),
    ]
    for kernel, pointer in refused:
        with pytest.raises(gramian.Problem) as caught:
            cloud.normals(kernel=kernel)
        assert caught.value.pointer == pointer
