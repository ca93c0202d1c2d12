"""Displays of matrices: their entries as colours, or where sparse ones have any."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from .axes import axes_of
from .colours import limits_of, mappable_of


class MatrixDisplay:
    """A matrix `[m, n]` that turns values at n points into numbers at m queries.

    Parameters
    ----------
    matrix
        `[m, n]`, an array or a sparse matrix of SciPy.
    name
        Title of the picture.
    unit
        Unit of the entries.
    """

    def __init__(self, matrix: Any, *, name: str = "", unit: str = "") -> None:  # noqa: ANN401 (array, csr_matrix)
        self.matrix = matrix
        self.name = name
        self.unit = unit

    def plot(self, ax: Any = None) -> Self:  # noqa: ANN401 (Axes)
        """Draws the entries of an array as colours, and places of entries of a sparse matrix as dots."""
        axes = axes_of(ax)
        if isinstance(self.matrix, np.ndarray):
            self.mappable_ = mappable_of(limits_of(self.matrix, is_signed=True), "RdYlBu_r")
            axes.imshow(self.matrix, norm=self.mappable_.norm, cmap=self.mappable_.cmap, aspect="auto")
            axes.figure.colorbar(self.mappable_, ax=axes, extend="both", label=self.unit)
        else:
            self.mappable_ = axes.spy(self.matrix, markersize=1, aspect="auto", rasterized=True)
            axes.xaxis.set_ticks_position("bottom")
        axes.set_xlabel("point")
        axes.set_ylabel("query")
        axes.set_title(self.name)
        self.axes_, self.figure_ = axes, axes.figure
        return self
