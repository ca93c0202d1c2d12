"""Answers as tables, files and objects of other libraries.

| ending | opens in | has |
|---|---|---|
| `.ply` | MeshLab, CloudCompare, Blender | a property for each number, `quality` and colours of one quantity |
| `.vtp` | ParaView, VisIt, PyVista | the arrays of the answer, also vectors, with colours |
| `.csv` | spreadsheets, pandas, R | a column for each number, and flags in words |
| `.npz` | NumPy (sparse matrices: SciPy) | the arrays of the answer in their shapes, and the diagnostics |
| `.glb`, `.obj`, `.stl` | viewers of meshes | the triangles of a mesh (extra `mesh`) |
"""

from .files import replace_file
from .libraries import to_pandas, to_pyvista
from .quantities import Quantity, in_units, quantities_of
from .save import npz_of, save, writers_of
from .table import Table, table_of

__all__ = [
    "Quantity",
    "Table",
    "in_units",
    "npz_of",
    "quantities_of",
    "replace_file",
    "save",
    "table_of",
    "to_pandas",
    "to_pyvista",
    "writers_of",
]
