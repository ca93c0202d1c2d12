"""Sparse matrices. They need SciPy, the extra `gramian[scipy]`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..wire.tensors import Members

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


def require_scipy() -> None:
    """Imports SciPy. Called only when it is needed, since it takes a moment, and before anything is sent.

    Raises
    ------
    ModuleNotFoundError
        If SciPy is not installed.
    """
    try:
        import scipy.sparse  # noqa: F401
    except ModuleNotFoundError as error:
        message = "sparse matrices are those of SciPy, which is not installed: pip install 'gramian[scipy]'"
        raise ModuleNotFoundError(message, name="scipy") from error


def csr_matrices(members: Members) -> list[csr_matrix]:
    """Reads the matrices of an answer, one per component, with their entries at the same places."""
    from scipy.sparse import csr_matrix

    *components, m, n = members.integers("shape").tolist()
    indptr, indices = members.integers("indptr"), members.integers("indices")
    data = members.array("data").reshape(*components or [1], len(indices))
    return [csr_matrix((entries, indices, indptr), shape=(m, n)) for entries in data]
