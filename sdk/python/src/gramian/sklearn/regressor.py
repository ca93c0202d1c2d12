"""Gaussian-process regression with the interface of scikit-learn."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, Self, overload

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.gaussian_process.kernels import Kernel as SklearnKernel
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data

from ..answers import Posterior
from ..arguments.fit import Duplicates, KernelLike, Mean, Number, Quantity, Solver
from ..client import Client
from ..resources.cloud import Cloud
from ..rest.models import KernelUsed, SolverUsed
from ..rest.types import Unset
from ..service import shared_client
from ..wire.problems import NotPositiveDefinite, Problem
from ..wire.tensors import Array
from .kernels import converted, is_of_sklearn


class KernelRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):  # type: ignore[misc]  # sklearn has no types
    """Gaussian-process regression by the service, which learns kernel, noise and mean from the values.

    Predictions have the shapes and the meaning of scikit-learn's `GaussianProcessRegressor`. If `y` has the
    shape `[n, k]`, each column is fitted separately. Up to 2,000 samples of up to 16 features have a length
    scale for each feature where `y` calls for that. Otherwise kernels depend on distances in X: scale features
    of different units, or give a kernel with a length scale for each.

    Parameters
    ----------
    kernel : str, dict, Kernel or a kernel of scikit-learn, optional
        A family (`"gauss"`), one with parameters (`gramian.Kernel("gauss", length_scale=2)` or a dictionary,
        with `length_scales` for one per feature), or `kernel_` of another regressor. Of
        `sklearn.gaussian_process.kernels`, `RBF` or `Matern`, times `ConstantKernel`, plus `WhiteKernel`. If
        absent, learned from the values by their likelihood. If given, nothing is learned.
        `"gauss"` is exp(−r²/ℓ²), which is `RBF` with `length_scale` ℓ/√2.
    alpha : float or array_like, `[n]`, optional
        Noise variance of all samples or of each, in the unit of `y` squared. That of a `WhiteKernel` is added.
        If absent, learned if the kernel is, else 1e-10.
    mean : str, optional
        Mean of the function, beside the kernel: `"zero"`, `"constant"`, or `"linear"` in the features. If
        absent, a constant where `kernel` is absent too, else zero.
    solver : str, optional
        `"dense"`; `"landmark"` for smooth kernels on many samples, or `"iterative"` for rough ones; `"local"`
        to predict from the nearest samples; or `"auto"` (if absent): dense up to the largest size that the
        service factorizes, beyond it landmarks where few are enough, else local.
    duplicates : str, optional
        Policy for samples at the same place when `alpha` is 0: `"refuse"` (if absent) or `"merge"`.
    client : Client or str, optional
        The service, or its address. If absent, that of `gramian.cloud`: at `GRAMIAN_URL`, or else on this
        machine, one for each process. Clones share a `Client`. A pickle keeps only its address, and the key
        is that of `GRAMIAN_API_KEY` where the pickle is loaded.

    Attributes
    ----------
    kernel_ : KernelUsed, or k of them
        The kernel, learned or given, with all its parameters.
    alpha_ : float, or array of `[n]` or `[k]`
        Noise variance: of each sample if it was given so, else of each column of `y`.
    mean_coefficients_ : array of `[p]` or `[k, p]`
        The constant, then a slope per feature. p is 0, 1 or 1 + d.
    log_marginal_likelihood_value_ : float or None
        Log marginal likelihood of the values, summed over columns. None with the local and the iterative
        solver, and where the matrix has no Cholesky factor.
    cloud_id_ : str
        The id of the samples in the service.
    X_train_, y_train_ : arrays
        The fitted data, as float64. If the service has forgotten it, predictions send it again.
    n_features_in_, feature_names_in_
        As for all estimators.

    Examples
    --------
    >>> from gramian.sklearn import KernelRegressor
    >>> x = np.linspace(0, 6, 60)[:, None]
    >>> y = np.sin(x[:, 0]) + np.random.default_rng(0).normal(scale=0.1, size=60)
    >>> model = KernelRegressor().fit(x, y)
    >>> mean, std = model.predict([[1.5], [9.0]], return_std=True)
    >>> abs(mean[0] - np.sin(1.5)) < 3 * std[0], std[0] < 0.1 < std[1], np.sqrt(model.alpha_).round(1)
    (np.True_, np.True_, np.float64(0.1))
    """

    def __init__(
        self,
        kernel: KernelLike | SklearnKernel | None = None,
        *,
        alpha: Number | npt.ArrayLike | None = None,
        mean: Mean | None = None,
        solver: Solver | None = None,
        duplicates: Duplicates | None = None,
        client: Client | str | None = None,
    ) -> None:
        """Keeps the parameters. `fit` checks them."""
        self.kernel = kernel
        self.alpha = alpha
        self.mean = mean
        self.solver = solver
        self.duplicates = duplicates
        self.client = client

    def __getstate__(self) -> dict[str, Any]:
        client = self.client
        address = str(client._connection.http.base_url) if isinstance(client, Client) else client
        return {**super().__getstate__(), "client": address}

    def fit(self, X: npt.ArrayLike, y: npt.ArrayLike) -> Self:
        """Registers the samples, and learns what is not given.

        Later calls use what was learned, so predictions repeat to the last bit.

        Parameters
        ----------
        X : array_like, `[n, d]`
            A row of features for each sample. At most 16, unless the service is configured otherwise.
        y : array_like, `[n]` or `[n, k]`
            The values.

        Raises
        ------
        ValueError
            If there are more features than the service accepts.
        Problem
            If the service refuses anything else.
        """
        points, values = validate_data(self, X, y, dtype=np.float64, multi_output=True, y_numeric=True)
        choices = self._choices(len(points))
        cloud = _registered(self._service(), points)
        self.X_train_, self.y_train_ = cloud.points, np.array(values, dtype=np.float64)
        self.cloud_id_, self._description = cloud.id, cloud.description
        self._keep([_pinned(cloud, column, choices) for column in self._columns()])
        return self

    @overload
    def predict(self, X: npt.ArrayLike) -> Array: ...

    @overload
    def predict(self, X: npt.ArrayLike, *, return_std: Literal[True]) -> tuple[Array, Array]: ...

    @overload
    def predict(self, X: npt.ArrayLike, *, return_cov: Literal[True]) -> tuple[Array, Array]: ...

    @overload
    def predict(
        self, X: npt.ArrayLike, return_std: bool = False, return_cov: bool = False
    ) -> Array | tuple[Array, Array]: ...

    def predict(
        self, X: npt.ArrayLike, return_std: bool = False, return_cov: bool = False
    ) -> Array | tuple[Array, Array]:
        """Returns the posterior mean, and its standard deviations or covariances if requested.

        Parameters
        ----------
        X : array_like, `[m, d]`
            Features at which to predict.
        return_std : bool, optional
            True to return standard deviations too. They are those of the function, without noise. A new
            observation has `np.sqrt(std**2 + alpha_)`.
        return_cov : bool, optional
            True to return covariances of the function too. The local solver has none.

        Returns
        -------
        mean : array of `[m]`, or `[m, k]` if y has several columns
        std : array of `[m]` or `[m, k]`
        cov : array of `[m, m]` or `[m, m, k]`
        """
        if return_std and return_cov:
            raise RuntimeError("At most one of return_std or return_cov can be requested.")
        if return_std:
            answers = self._posteriors(X, "variances")
            return _stacked(answers, "means"), np.sqrt(_stacked(answers, "variances"))
        if return_cov:
            answers = self._posteriors(X, "covariance")
            return _stacked(answers, "means"), _stacked(answers, "covariance")
        return _stacked(self._posteriors(X), "means")

    def sample_y(
        self, X: npt.ArrayLike, n_samples: int = 1, random_state: int | np.random.RandomState | None = 0
    ) -> Array:
        """Draws functions from the posterior, and returns their values, without noise.

        Not available with the local solver.

        Parameters
        ----------
        X : array_like, `[m, d]`
            Features at which to evaluate the functions.
        n_samples : int, optional
            Number of functions.
        random_state : int, RandomState or None, optional
            Source of randomness. None draws new functions at every call.

        Returns
        -------
        array of `[m, n_samples]`, or `[m, k, n_samples]` if y has several columns
        """
        random = check_random_state(random_state)
        answers = self._posteriors(X, "covariance")
        draws = [random.multivariate_normal(answer.means, answer.covariance, n_samples).T for answer in answers]
        return np.asarray(draws[0]) if len(draws) == 1 else np.stack(draws, axis=1)

    def _service(self) -> Client:
        if isinstance(self.client, Client):
            return self.client
        return shared_client(self.client)

    def _choices(self, n: int) -> dict[str, Any]:
        """Returns the parameters as keywords of `Cloud.posterior`."""
        choices = {name: getattr(self, name) for name in ("kernel", "mean", "solver", "duplicates")}
        alpha: Any = self.alpha
        if is_of_sklearn(self.kernel):
            same = converted(self.kernel)
            choices["kernel"] = same.kernel
            if same.noise is not None:
                alpha = same.noise if alpha is None else np.add(alpha, same.noise)
        shape = np.shape(alpha)
        if shape not in ((), (n,)):
            raise ValueError(f"alpha is to be a number, or one for each of the {n} samples, not of the shape {shape}")
        return {**choices, "noise_variances" if shape else "alpha": alpha}

    def _columns(self) -> Iterator[Array]:
        yield from self.y_train_.reshape(len(self.y_train_), -1).T

    def _keep(self, answers: list[Posterior]) -> None:
        """Stores the fit of each column in the attributes."""
        self._fits = [answer.fit for answer in answers]
        used = [answer.diagnostics for answer in answers]
        kernels = [each.kernel for each in used]
        noise = [fit.get("noise_variances", fit.get("alpha")) for fit in self._fits]
        means = [[] if isinstance(each.mean_coefficients, Unset) else each.mean_coefficients for each in used]
        likelihoods = [each.log_marginal_likelihood for each in answers if hasattr(each, "log_marginal_likelihood")]
        is_single = len(answers) == 1
        self.kernel_: KernelUsed | list[KernelUsed] = kernels[0] if is_single else kernels
        self.alpha_: Any = noise[0] if is_single or "noise_variances" in self._fits[0] else np.array(noise)
        self.mean_coefficients_ = np.array(means[0] if is_single else means, dtype=np.float64)
        self.log_marginal_likelihood_value_ = sum(likelihoods) if likelihoods else None

    def _posteriors(self, X: npt.ArrayLike, include: Quantity | None = None) -> list[Posterior]:
        """Computes the posterior of each column, with a cloud that belongs to the client of this process."""
        check_is_fitted(self)
        queries = validate_data(self, X, dtype=np.float64, reset=False)
        cloud = Cloud(self._service()._connection, self._description, self.X_train_)
        fits = zip(self._columns(), self._fits, strict=True)
        return [cloud.posterior(values, queries, include=include, **fit) for values, fit in fits]


def _registered(client: Client, points: Array) -> Cloud:
    """Registers samples.

    Raises
    ------
    ValueError
        If there are too many features.
    """
    try:
        return client.cloud(points)
    except Problem as problem:
        if problem.slug != "problem-too-large" or problem.required != points.shape[1]:
            raise
        raise ValueError(
            f"X has {problem.required} features, and the service takes {problem.limit} at most: select features, put "
            f"sklearn.decomposition.PCA({problem.limit}) before this in a pipeline, or raise the limit of the service, "
            "GRAMIAN_MAX_DIMENSION"
        ) from problem


def _pinned(cloud: Cloud, values: Array, choices: dict[str, Any]) -> Posterior:
    """Fits values, and returns the answer at one point, with the likelihood if the solver has it."""
    somewhere = None if cloud.points is None else cloud.points[:1]
    answer = cloud.posterior(values, somewhere, **choices)
    if answer.diagnostics.solver in (SolverUsed.LOCAL, SolverUsed.ITERATIVE):
        return answer
    try:
        return cloud.posterior(values, somewhere, include="log_marginal_likelihood", **answer.fit)
    except NotPositiveDefinite:
        # Means exist nevertheless, from the part of the matrix that has a factor.
        return answer


def _stacked(answers: list[Posterior], member: str) -> Array:
    """Returns a member of the answers as a new array, with a last axis for columns if there are several."""
    arrays: list[Array] = [getattr(answer, member) for answer in answers]
    return np.array(arrays[0]) if len(arrays) == 1 else np.stack(arrays, axis=-1)
