"""Answers as objects of other libraries."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..plot.needed import needed
from .table import Table


def to_pandas(table: Table) -> Any:  # noqa: ANN401 (DataFrame)
    """Returns a `pandas.DataFrame` with a row for each row of the table, and flags and words as text.

    Raises
    ------
    ModuleNotFoundError
        If pandas is not installed.
    """
    return needed("pandas", "pandas").DataFrame({**table.columns(), **table.texts()})


def to_pyvista(table: Table) -> Any:  # noqa: ANN401 (PolyData)
    """Returns a `pyvista.PolyData` with the arrays that a `.vtp` file has.

    Raises
    ------
    ModuleNotFoundError
        If pyvista is not installed.
    ValueError
        If the positions are not known, or have more than three coordinates.
    """
    pyvista = needed("pyvista", "pyvista")
    places = table.in_space("PyVista")
    made = pyvista.PolyData(places)
    if table.cells is not None:
        n_corners = table.cells.shape[1]
        padded = np.column_stack([np.full(len(table.cells), n_corners), table.cells]).ravel()
        made = pyvista.PolyData(places, padded) if n_corners == 3 else pyvista.PolyData(places, lines=padded)
    for name, array in table.vectors().items():
        made.point_data[name] = array
    if table.quantity in table.vectors():
        made.set_active_scalars(table.quantity)
    return made
