"""Points of other libraries: tables with columns, and arrays that NumPy can read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gramian

POINTS = np.array([[0.0, 1.0, 5.0], [1.0, 0.5, 4.0], [2.0, 0.25, 3.0], [3.0, 2.0, 1.0]])
COLUMNS = {name: POINTS[:, at] for at, name in enumerate(["x", "y", "height"])}

TABLES: dict[str, Any] = {
    "DataFrame": pd.DataFrame({**COLUMNS, "name": list("abcd")}),
    "Dataset": xr.Dataset({name: ("point", column) for name, column in COLUMNS.items()}),
    "structured array": np.array([tuple(point) for point in POINTS], dtype=[(name, float) for name in COLUMNS]),
    "dictionary": {name: column.tolist() for name, column in COLUMNS.items()},
}
every_table = pytest.mark.parametrize("table", TABLES.values(), ids=TABLES.keys())


@every_table
def test_columns_of_a_table_are_points(table: Any) -> None:
    client = gramian.Client()
    found = client.cloud(table, columns=["height", "x"])
    assert found.points is not None
    np.testing.assert_array_equal(found.points, POINTS[:, [2, 0]])
    assert found.id == client.cloud(POINTS[:, [2, 0]]).id


@every_table
def test_an_unknown_column_is_named(table: Any) -> None:
    with pytest.raises(ValueError, match=r"^points have no column 'hight'; did you mean 'height'\?"):
        gramian.Client().cloud(table, columns=["x", "hight"])


def test_columns_are_those_of_a_table() -> None:
    client = gramian.Client()
    with pytest.raises(TypeError, match=r"a list of names, such as \['x'\], not a single one"):
        client.cloud(TABLES["DataFrame"], columns="x")
    with pytest.raises(TypeError, match="columns are those of a table, and points are of the type str"):
        client.cloud("scan.ply", columns=["x"])
    with pytest.raises(ValueError, match="points have no column 'x'"):
        client.cloud(POINTS, columns=["x"])
    with pytest.raises(ValueError, match="columns are to be of one length"):
        client.cloud({"x": [0, 1], "y": [0]}, columns=["x", "y"])


@pytest.mark.parametrize("library", [pd.DataFrame, xr.DataArray, np.asarray], ids=["pandas", "xarray", "NumPy"])
def test_arrays_of_other_libraries_go_in(library: Any) -> None:
    cloud = gramian.Client().cloud(library(POINTS))
    plain = cloud.interpolate(POINTS[:, 0], POINTS[:2])
    column = library(POINTS)[0] if library is pd.DataFrame else library(POINTS)[:, 0]
    answer = cloud.interpolate(column, library(POINTS[:2]))
    np.testing.assert_array_equal(answer.values, plain.values)
