"""A regressor with the interface of scikit-learn. Needs scikit-learn, the extra `gramian[sklearn]`."""

try:
    import sklearn  # noqa: F401  # the absolute one
except ImportError as error:
    message = "gramian.sklearn needs scikit-learn, 1.6 or later: pip install 'gramian[sklearn]'"
    raise ImportError(message, name="sklearn") from error

from .regressor import KernelRegressor

__all__ = ["KernelRegressor"]
