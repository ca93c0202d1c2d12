"""Operators on surfaces."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from ..arguments.options import OperatorFit, SurfaceOperatorFit
from ..export import Table
from ..rest.models import Diagnostics, Flag
from ..wire.tensors import Array, Members
from .answer import Answer
from .asked import asked
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


class MatrixAnswer(OperatorAnswer):
    """The base class of matrices that turn values at the points into numbers at the queries."""

    def plot(self, component: int = 0, ax: Any = None, *, length_unit: str = "L") -> Any:  # type: ignore[override]  # noqa: ANN401 (Axes, MatrixDisplay)
        """Draws the entries of a matrix: as colours, or as dots where a sparse one has any.

        Parameters
        ----------
        component : int, optional
            The coordinate, for matrices of gradients. 0 if absent.
        ax : matplotlib.axes.Axes, optional
            Where to draw. New axes if absent.
        length_unit : str, optional
            Unit of lengths, such as `"mm"`. L if absent.
        """
        from ..plot import MatrixDisplay

        matrices = self._matrices()
        name = re.sub("(?<!^)(?=[A-Z])", " ", type(self).__name__)
        shown = name if len(matrices) == 1 else f"{name}, component {component}"
        member = "matrices" if hasattr(self, "matrices") else "matrix"
        return MatrixDisplay(matrices[component], name=shown, unit=self.unit(member, length_unit)).plot(ax)

    def __str__(self) -> str:
        head, *others = super().__str__().splitlines()
        m, n = self._matrices()[0].shape
        stored = getattr(self._matrices()[0], "nnz", m * n) / m
        member = "matrices" if hasattr(self, "matrices") else "matrix"
        shape = f"{member}: {m:,} × {n:,}, {stored:.3g} entries a row, {self.unit(member)}"
        return "\n".join([head, shape, *others])

    def _matrices(self) -> Sequence[Any]:
        """Returns the matrices, one for each component."""
        return [self.matrix] if hasattr(self, "matrix") else self.matrices  # type: ignore[attr-defined]

    def _writers(self, table: Callable[[], Table]) -> dict[str, Callable[[], bytes]]:
        # A matrix has no row of numbers for a position, so it is saved whole.
        return {".npz": super()._writers(table)[".npz"]}


class SparseAnswer(MatrixAnswer):
    """The base class of sparse matrices."""

    def _arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Returns what `scipy.sparse.load_npz` reads: `data` has an axis for components if there are several."""
        first, *others = self._matrices()
        data = np.stack([matrix.data for matrix in (first, *others)])
        return {
            **super()._arrays(),
            "format": np.array(b"csr"),
            "shape": np.array(first.shape),
            "indptr": first.indptr,
            "indices": first.indices,
            "data": data if others else data[0],
        }


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
    gradient_std: Array = asked("std=True")
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: OperatorFit

    SUMMARY: ClassVar = ("gradients",)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SurfaceGradientMatrix(MatrixAnswer):
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
class SurfaceGradientSparseMatrix(SparseAnswer):
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
    laplacian_std: Array = asked("std=True")
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: OperatorFit

    SUMMARY: ClassVar = ("laplacians",)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class LaplaceBeltramiMatrix(MatrixAnswer):
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
class LaplaceBeltramiSparseMatrix(SparseAnswer):
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
