"""Conversion of scikit-learn's kernels.

| scikit-learn | here |
|---|---|
| `ConstantKernel(c)` | the factor `variance=c` |
| `RBF(length_scale=l)` | `Kernel("gauss", length_scale=√2 l)`: RBF is exp(−r²/(2l²)), and `gauss` exp(−r²/ℓ²) |
| `Matern(length_scale=l, nu=nu)` | `Kernel("matern", length_scale=l, nu=nu)`, and for `nu=inf` that of RBF |
| `WhiteKernel(noise_level=v)` | the noise `alpha=v` |
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, Product, Sum, WhiteKernel
from sklearn.gaussian_process.kernels import Kernel as SklearnKernel

from ..arguments.fit import Kernel

CONVERTIBLE = "RBF or Matern, times ConstantKernel, plus WhiteKernel"


@dataclass(frozen=True)
class Converted:
    """A kernel with its noise."""

    kernel: Kernel
    #: Variance of the noise, None without a `WhiteKernel`.
    noise: float | None


def is_of_sklearn(kernel: object) -> bool:
    """Returns whether this is a kernel of scikit-learn."""
    return isinstance(kernel, SklearnKernel)


def converted(kernel: SklearnKernel) -> Converted:
    """Returns the kernel here that has the same covariances.

    Raises
    ------
    ValueError
        If there is none.
    """
    terms = _parts(kernel, Sum)
    noises = [_noise(term) for term in terms]
    correlated = [term for term, noise in zip(terms, noises, strict=True) if noise is None]
    if len(correlated) != 1:
        raise _refusal(kernel)
    white = [noise for noise in noises if noise is not None]
    return Converted(_correlation(correlated[0]), sum(white) if white else None)


def _parts(kernel: Any, kind: Any) -> list[Any]:  # noqa: ANN401  # sklearn has no types
    """Returns the terms of a sum, or the factors of a product."""
    return _parts(kernel.k1, kind) + _parts(kernel.k2, kind) if isinstance(kernel, kind) else [kernel]


def _factors(kernel: Any) -> tuple[float, list[Any]]:  # noqa: ANN401
    """Returns the constant factor of a product, and its other factors."""
    factors = _parts(kernel, Product)
    constants = [float(factor.constant_value) for factor in factors if isinstance(factor, ConstantKernel)]
    return float(np.prod(constants)), [factor for factor in factors if not isinstance(factor, ConstantKernel)]


def _noise(term: Any) -> float | None:  # noqa: ANN401
    """Returns the variance of white noise, None for other terms."""
    factor, others = _factors(term)
    return factor * float(others[0].noise_level) if _is_single(others, WhiteKernel) else None


def _is_single(factors: list[Any], kind: type) -> bool:
    return len(factors) == 1 and type(factors[0]) is kind


def _correlation(term: Any) -> Kernel:  # noqa: ANN401
    variance, others = _factors(term)
    if _is_single(others, RBF):
        return _of_scales("gauss", np.sqrt(2) * np.asarray(others[0].length_scale), variance)
    if _is_single(others, Matern):
        length_scale, nu = np.asarray(others[0].length_scale), float(others[0].nu)
        if np.isinf(nu):
            return _of_scales("gauss", np.sqrt(2) * length_scale, variance)
        return _of_scales("matern", length_scale, variance, nu=nu)
    raise _refusal(term)


def _of_scales(family: str, length_scales: Any, variance: float, **parameters: float) -> Kernel:  # noqa: ANN401
    """Returns a kernel with one length scale, or one for each feature."""
    name = "length_scales" if np.ndim(length_scales) else "length_scale"
    return Kernel(family, variance=variance, **{name: length_scales}, **parameters)  # type: ignore[arg-type]


def _refusal(kernel: object) -> ValueError:
    return ValueError(f"kernel is {kernel!r}, and what can be converted is {CONVERTIBLE}")
