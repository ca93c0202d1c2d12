"""Answers: arrays with the shapes documented here, and the service's diagnostics.

n is the number of points of the cloud, d their dimension, m the number of queries and k the number of lists
of values. L is the unit of the coordinates and V the unit of the values.

Arrays keep the order of the request. They are read-only views of the answer's bytes: `.copy()` them to change
them. They have NaN where there is no meaningful number, and `flags` then says why. Answers can be
pickled and used by several threads. `print` shows a summary, `repr` arrays by their shapes. `save`, `to_pandas` and
`to_pyvista` hand their numbers on, `plot` draws them.
"""

from .answer import Answer
from .batches import InterpolationBatch, PosteriorBatch
from .mesh import Mesh
from .operators import (
    LaplaceBeltrami,
    LaplaceBeltramiMatrix,
    LaplaceBeltramiSparseMatrix,
    SurfaceGradient,
    SurfaceGradientMatrix,
    SurfaceGradientSparseMatrix,
)
from .selection import AlphaPath, LeaveOneOut, ModelSelection
from .surface import Curvatures, Normals
from .values import Data, Interpolation, Posterior

__all__ = [
    "AlphaPath",
    "Answer",
    "Curvatures",
    "Data",
    "Interpolation",
    "InterpolationBatch",
    "LaplaceBeltrami",
    "LaplaceBeltramiMatrix",
    "LaplaceBeltramiSparseMatrix",
    "LeaveOneOut",
    "Mesh",
    "ModelSelection",
    "Normals",
    "Posterior",
    "PosteriorBatch",
    "SurfaceGradient",
    "SurfaceGradientMatrix",
    "SurfaceGradientSparseMatrix",
]
