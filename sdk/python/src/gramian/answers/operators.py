"""Operators on surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from ..arguments.options import OperatorFit, SurfaceOperatorFit
from ..rest.models import Diagnostics, Flag
from ..wire.tensors import Array, Members
from .answer import Answer
from .fit import operator_fit_used
from .sparse import csr_matrices

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


class OperatorAnswer(Answer):
    """The base class of answers about operators on a surface."""

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer and the options of its fit."""
        return super().read(members, fit=operator_fit_used(members), **derived)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SurfaceGradient(OperatorAnswer):
    """Surface gradients ∇u − (∇u·ν)ν of the values at the queries.

    Attributes
    ----------
    gradients
        `[m, d]`, V/L, tangent to the surface.
    gradient_std
        `[m, d]`, V/L, with `std`. Standard deviations given the values and, as far as it is known, the
        surface.
    flags
        The queries without a normal, or with a doubtful one.
    diagnostics
        Diagnostics of the fit of the values. `diagnostics.surface` describes the fit of the surface.
    fit
        All options of the fit, as used, including those of the surface. `**answer.fit` in a call repeats the
        fit.
    """

    gradients: Array
    gradient_std: Array | None = None
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: OperatorFit


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SurfaceGradientMatrix(OperatorAnswer):
    """The surface gradient as matrices, one per coordinate.

    Attributes
    ----------
    matrices
        `[d, m, n]`, 1/L. `matrices @ values` has the shape `[d, m]`.
    flags
        The queries without a normal, or with a doubtful one.
    diagnostics
        Diagnostics of the fit of values. `diagnostics.surface` describes the fit of the surface.
    fit
        All options of the fit, as used, including those of the surface. `**answer.fit` in a call repeats the
        fit.
    """

    matrices: Array
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: OperatorFit


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SurfaceGradientSparseMatrix(OperatorAnswer):
    """The surface gradient as sparse matrices, one per coordinate.

    Attributes
    ----------
    matrices
        d matrices of type `scipy.sparse.csr_matrix`, each `[m, n]`, 1/L. All have entries at the same places.
        `matrices[i] @ values` is component i at the queries. Rows of queries without a normal have no
        entries.
    flags
        The queries without a normal, or with a doubtful one.
    diagnostics
        Diagnostics of the fit of the surface. Nothing is fitted to values.
    fit
        All options of the fit of the surface, as used. `**answer.fit` in a call repeats it.
    """

    matrices: list[csr_matrix]
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: SurfaceOperatorFit

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer and makes matrices of SciPy of it."""
        return super().read(members, matrices=csr_matrices(members), **derived)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class LaplaceBeltrami(OperatorAnswer):
    """The Laplace–Beltrami operator of the values at the queries: on the unit circle Δ cos θ = −cos θ.

    Attributes
    ----------
    laplacians
        `[m]`, V/L². Δu.
    laplacian_std
        `[m]`, V/L², with `std`. Standard deviations given the values and, as far as it is known, the
        surface.
    flags
        The queries without a normal, or with a doubtful one.
    diagnostics
        Diagnostics of the fit of the values. `diagnostics.surface` describes the fit of the surface.
    fit
        All options of the fit, as used, including those of the surface. `**answer.fit` in a call repeats the
        fit.
    """

    laplacians: Array
    laplacian_std: Array | None = None
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: OperatorFit


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class LaplaceBeltramiMatrix(OperatorAnswer):
    """The Laplace–Beltrami operator as a matrix: on the unit circle `matrix @ cos θ` is −cos θ.

    Attributes
    ----------
    matrix
        `[m, n]`, 1/L². `matrix @ values` is Δu at the queries. Not symmetric in general.
    flags
        The queries without a normal, or with a doubtful one.
    diagnostics
        Diagnostics of the fit of values. `diagnostics.surface` describes the fit of the surface.
    fit
        All options of the fit, as used, including those of the surface. `**answer.fit` in a call repeats the
        fit.
    """

    matrix: Array
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: OperatorFit


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class LaplaceBeltramiSparseMatrix(OperatorAnswer):
    """The Laplace–Beltrami operator as a sparse matrix: on the unit circle `matrix @ cos θ` is −cos θ.

    Attributes
    ----------
    matrix
        `scipy.sparse.csr_matrix`, `[m, n]`, 1/L². `matrix @ values` is Δu at the queries. Not symmetric. Rows
        of queries without a normal have no entries.
    flags
        The queries without a normal, or with a doubtful one.
    diagnostics
        Diagnostics of the fit of the surface. Nothing is fitted to values.
    fit
        All options of the fit of the surface, as used. `**answer.fit` in a call repeats it.
    """

    matrix: csr_matrix
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: SurfaceOperatorFit

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer and makes matrices of SciPy of it."""
        [matrix] = csr_matrices(members)
        return super().read(members, matrix=matrix, **derived)
