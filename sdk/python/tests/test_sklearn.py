"""`KernelRegressor` as an estimator of scikit-learn, against the server."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sklearn
from sklearn.base import clone
from sklearn.decomposition import PCA
from sklearn.exceptions import NotFittedError
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, Matern, WhiteKernel
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

import gramian
from gramian.sklearn import KernelRegressor
from gramian.wire.tensors import Array

ESTIMATORS = [KernelRegressor(), KernelRegressor("matern", alpha=0.1), KernelRegressor(mean="zero", solver="local")]

CHOICES: dict[str, dict[str, Any]] = {
    "nothing": {},
    "noise": {"alpha": 0.02},
    "noise of each": {"alpha": np.linspace(0.01, 0.03, 200)},
    "kernel": {"kernel": gramian.Kernel("gauss", length_scale=0.4), "alpha": 0.01, "mean": "constant"},
    "length scales": {"kernel": gramian.Kernel("gauss", length_scales=[0.3, 1]), "alpha": 0.01},
    "linear": {"mean": "linear", "duplicates": "merge"},
    "local": {"solver": "local"},
    "local with a kernel": {"solver": "local", "kernel": {"family": "matern", "length_scale": 0.5}, "alpha": 0.01},
    "local with length scales": {"solver": "local", "kernel": gramian.Kernel("matern", length_scales=[0.3, 1])},
    "local with noise of each": {"solver": "local", "alpha": np.linspace(0.01, 0.03, 200)},
}
every_choice = pytest.mark.parametrize("choices", CHOICES.values(), ids=CHOICES.keys())


def field(n: int, seed: int) -> tuple[Array, Array]:
    """Returns points of a square, and values there with noise of standard deviation 0.1."""
    random = np.random.default_rng(seed)
    points = random.uniform(size=(n, 2))
    return points, truth(points) + random.normal(scale=0.1, size=n)


def truth(points: Array) -> Array:
    return np.asarray(np.sin(6 * points[:, 0]) * points[:, 1])


X, Y = field(200, seed=0)
QUERIES = field(20, seed=1)[0]

#: Kernels of scikit-learn that are converted.
OF_SKLEARN = {
    "RBF": RBF(0.3),
    "length scales": RBF([0.3, 0.7]),
    "Matern": Matern(0.4, nu=1.5),
    "Matern with a length scale for each": Matern([0.4, 0.6], nu=2.5),
    "Matern, smooth": Matern(0.3, nu=np.inf),
    "with a factor": ConstantKernel(2.5) * RBF(0.3),
    "with noise": 1.5 * Matern(0.4, nu=0.5) + WhiteKernel(0.01),
    "with noise twice": WhiteKernel(0.01) + 2.0 * RBF(0.3) + 0.5 * WhiteKernel(0.02),
}


@parametrize_with_checks(ESTIMATORS)  # type: ignore[untyped-decorator]
def test_it_is_an_estimator(estimator: Any, check: Callable[[Any], None]) -> None:
    check(estimator)


@every_choice
def test_predictions_are_those_of_the_posterior(client: gramian.Client, choices: dict[str, Any]) -> None:
    model = KernelRegressor(**choices).fit(X, Y)
    is_each = np.ndim(choices.get("alpha", 0)) > 0
    fit = {"noise_variances" if is_each and name == "alpha" else name: value for name, value in choices.items()}
    answer = client.cloud(X).posterior(Y, QUERIES, include="variances", **fit)
    mean, std = model.predict(QUERIES, return_std=True)
    np.testing.assert_array_equal(mean, answer.means)
    np.testing.assert_array_equal(std, np.sqrt(answer.variances))
    np.testing.assert_array_equal(model.predict(QUERIES[:3]), answer.means[:3])
    assert model.kernel_ == answer.diagnostics.kernel
    np.testing.assert_array_equal(model.alpha_, choices["alpha"] if is_each else answer.diagnostics.alpha)
    assert model.cloud_id_ == answer.diagnostics.cloud_id


def test_shapes_are_those_of_a_gaussian_process_of_sklearn() -> None:
    ours, theirs = KernelRegressor(), GaussianProcessRegressor(alpha=0.1, optimizer=None)
    for y in [Y, Y[:, None], np.column_stack([Y, X])]:
        for model in [ours, theirs]:
            model.fit(X, y)
        assert ours.predict(QUERIES).shape == theirs.predict(QUERIES).shape
        for wanted in ["return_std", "return_cov"]:
            shapes = [[array.shape for array in model.predict(QUERIES, **{wanted: True})] for model in [ours, theirs]]
            assert shapes[0] == shapes[1]
        assert ours.sample_y(QUERIES, 4).shape == theirs.sample_y(QUERIES, 4).shape
        with pytest.raises(RuntimeError, match=r"^At most one of return_std or return_cov can be requested\.$"):
            ours.predict(QUERIES, return_std=True, return_cov=True)


@pytest.mark.parametrize("scales", [1.0, [1.0, 0.5]], ids=["one", "one for each feature"])
def test_numbers_are_those_of_a_gaussian_process_of_sklearn(scales: Any) -> None:
    y = np.column_stack([Y, X[:, 0]])
    given = {"length_scale": scales} if isinstance(scales, float) else {"length_scales": scales}
    ours = KernelRegressor(gramian.Kernel("gauss", **given), alpha=0.01).fit(X, y)
    # The service has φ = exp(−r²), sklearn exp(−r²/2).
    theirs = GaussianProcessRegressor(RBF(np.sqrt(0.5) * np.asarray(scales)), alpha=0.01, optimizer=None).fit(X, y)
    np.testing.assert_allclose(ours.predict(QUERIES), theirs.predict(QUERIES), atol=1e-10)
    for wanted in ["return_std", "return_cov"]:
        found, expected = (model.predict(QUERIES, **{wanted: True})[1] for model in [ours, theirs])
        np.testing.assert_allclose(found, expected, atol=1e-8)
    assert ours.log_marginal_likelihood_value_ == pytest.approx(theirs.log_marginal_likelihood_value_)


def test_each_column_is_fitted_by_itself() -> None:
    both = KernelRegressor().fit(X, np.column_stack([Y, X[:, 1]]))
    mean, cov = both.predict(QUERIES, return_cov=True)
    for j, y in enumerate([Y, X[:, 1]]):
        alone = KernelRegressor().fit(X, y)
        for found, expected in zip((mean[:, j], cov[..., j]), alone.predict(QUERIES, return_cov=True), strict=True):
            np.testing.assert_array_equal(found, expected)
        assert isinstance(both.kernel_, list)
        assert (both.kernel_[j], both.alpha_[j]) == (alone.kernel_, alone.alpha_)
        np.testing.assert_array_equal(both.mean_coefficients_[j], alone.mean_coefficients_)
    assert both.alpha_[0] == pytest.approx(0.01, rel=0.3)


def test_samples_have_the_mean_and_the_covariance() -> None:
    model = KernelRegressor().fit(X, Y)
    mean, cov = model.predict(QUERIES[:4], return_cov=True)
    samples = model.sample_y(QUERIES[:4], 20_000)
    np.testing.assert_allclose(samples.mean(axis=1), mean, atol=5 * np.sqrt(cov.max() / 20_000))
    np.testing.assert_allclose(np.cov(samples), cov, atol=0.05 * cov.max())
    np.testing.assert_array_equal(samples, model.sample_y(QUERIES[:4], 20_000))


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")  # sklearn's default has no noise
def test_noisy_fields_are_found_as_well_as_by_sklearn_told_of_the_noise() -> None:
    train, test = field(300, seed=2), field(500, seed=3)[0]
    told = GaussianProcessRegressor(1.0 * RBF() + WhiteKernel(), random_state=0)
    models = [KernelRegressor(), told, GaussianProcessRegressor()]
    ours, theirs, by_default = (model.fit(*train).score(test, truth(test)) for model in models)
    assert ours > 0.99
    assert 1 - ours < 1.5 * (1 - theirs)
    assert ours > by_default


def test_deviations_are_those_of_the_function() -> None:
    test = field(500, seed=3)[0]
    mean, std = KernelRegressor().fit(*field(300, seed=2)).predict(test, return_std=True)
    assert std.max() < 0.1  # the noise
    assert 0.9 < np.mean(np.abs(mean - truth(test)) < 1.96 * std) <= 1


def test_pipelines_and_searches() -> None:
    scaled = make_pipeline(StandardScaler(), KernelRegressor())
    assert cross_val_score(scaled, X * [1, 1000], Y, cv=3).min() > 0.8
    kernels = [gramian.Kernel("gauss", length_scale=scale) for scale in [0.01, 0.5]]
    search = GridSearchCV(KernelRegressor(alpha=0.01), {"kernel": [*kernels, None], "mean": ["zero", None]}, cv=3)
    search.fit(X, Y)
    assert search.best_params_["kernel"] != kernels[0]
    assert search.best_score_ > 0.8


@every_choice
def test_a_pickle_predicts_the_same(client: gramian.Client, choices: dict[str, Any]) -> None:
    model = KernelRegressor(**choices, client=client).fit(X, Y)
    again = pickle.loads(pickle.dumps(model))
    assert again.client == str(client.rest.get_httpx_client().base_url)
    np.testing.assert_array_equal(again.predict(QUERIES), model.predict(QUERIES))
    np.testing.assert_array_equal(copy.deepcopy(model).predict(QUERIES), model.predict(QUERIES))


def test_clones_share_the_client(client: gramian.Client) -> None:
    alpha = np.full(len(X), 0.01)
    model = KernelRegressor("gauss", alpha=alpha, mean="linear", client=client)
    twin = clone(model)
    assert twin.client is client
    np.testing.assert_array_equal(twin.fit(X, Y).predict(QUERIES), model.fit(X, Y).predict(QUERIES))
    with pytest.raises(NotFittedError):
        clone(model).predict(QUERIES)


def test_what_the_service_has_forgotten_is_sent_again(client: gramian.Client) -> None:
    mine = X.copy()
    model = KernelRegressor().fit(mine, Y)
    expected = model.predict(QUERIES)
    mine[:] = 0
    client.cloud(X).delete()
    np.testing.assert_array_equal(model.predict(QUERIES), expected)
    client.cloud(X).delete()
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict(QUERIES), expected)


def test_too_many_features_are_refused_with_a_remedy() -> None:
    many = np.random.default_rng(0).normal(size=(40, 20))
    remedy = r"^X has 20 features, and the service takes 16 at most: .*PCA\(16\) before this .* GRAMIAN_MAX_DIMENSION$"
    with pytest.raises(ValueError, match=remedy):
        KernelRegressor().fit(many, many[:, 0])
    assert make_pipeline(PCA(16), KernelRegressor()).fit(many, many[:, 0]).predict(many).shape == (40,)


def test_other_refusals_say_what_is_wrong() -> None:
    with pytest.raises(ValueError, match=r"^alpha is to be .* each of the 200 samples, not of the shape \(3,\)$"):
        KernelRegressor(alpha=[1, 2, 3]).fit(X, Y)
    with pytest.raises(ValueError, match="did you mean 'gauss'"):
        KernelRegressor("gaus").fit(X, Y)
    with pytest.raises(gramian.Problem, match="the local solver treats each query separately, so it has no covariance"):
        KernelRegressor(solver="local").fit(X, Y).predict(QUERIES, return_cov=True)


def test_extreme_samples() -> None:
    assert KernelRegressor().fit([[1]], [3]).predict([[1], [100]]).tolist() == [3, 3]
    assert KernelRegressor().fit(X, np.full(200, 5)).predict(QUERIES) == pytest.approx(5)
    at_one_place = KernelRegressor().fit(np.ones((10, 2)), np.arange(10))
    assert at_one_place.predict([[1, 1]]) == pytest.approx(4.5)
    twice = KernelRegressor().fit(np.vstack([X, X]).astype(np.float32), np.concatenate([Y, Y]))
    assert twice.score(X, truth(X)) > 0.9


def test_without_sklearn_an_error_says_what_is_missing() -> None:
    program = """
import sys
sys.modules["sklearn"] = None  # as if it were not installed
import gramian
try:
    import gramian.sklearn
except ImportError as error:
    print(error.name, error)
"""
    printed = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout
    assert printed == "sklearn gramian.sklearn needs scikit-learn, 1.6 or later: pip install 'gramian[sklearn]'\n"
    assert sklearn.__name__ == "sklearn"  # not gramian's own module of that name


@pytest.mark.parametrize("kernel", OF_SKLEARN.values(), ids=OF_SKLEARN.keys())
@pytest.mark.parametrize("alpha", [1e-3, np.linspace(0.01, 0.03, 200)], ids=["alpha", "alpha of each"])
def test_kernels_of_scikit_learn_mean_the_same(kernel: Any, alpha: Any) -> None:
    theirs = GaussianProcessRegressor(kernel, alpha=alpha, optimizer=None).fit(X, Y)
    ours = KernelRegressor(kernel, alpha=alpha).fit(X, Y)
    np.testing.assert_allclose(ours.predict(QUERIES), theirs.predict(QUERIES), rtol=1e-7, atol=1e-8)
    if "WhiteKernel" not in str(kernel):  # with which theirs are of an observation, and ours of the function
        ours_std, theirs_std = (model.predict(QUERIES, return_std=True)[1] for model in (ours, theirs))
        np.testing.assert_allclose(ours_std, theirs_std, rtol=1e-5, atol=1e-7)


def test_the_noise_of_a_kernel_is_alpha() -> None:
    model = KernelRegressor(2.0 * RBF(0.3) + WhiteKernel(0.25)).fit(X, Y)
    assert model.alpha_ == 0.25
    assert isinstance(model.kernel_, gramian.KernelUsed)
    assert model.kernel_.variance == 2.0
    assert model.kernel_.length_scale == pytest.approx(0.3 * np.sqrt(2), rel=1e-15)


@pytest.mark.parametrize("kernel", [DotProduct(), RBF(1) + RBF(2), RBF(1) * Matern(1), WhiteKernel(), RBF(1) ** 2])
def test_other_kernels_of_scikit_learn_are_refused(kernel: Any) -> None:
    with pytest.raises(
        ValueError, match="what can be converted is RBF or Matern, times ConstantKernel, plus WhiteKernel"
    ):
        KernelRegressor(kernel).fit(X, Y)
