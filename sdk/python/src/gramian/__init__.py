"""A client of gramian, the service for geometric kernel interpolation and regression on point clouds.

>>> import gramian, numpy as np
>>> angles = np.arange(100) * np.pi / 50
>>> points = np.column_stack([2 * np.cos(angles), np.sin(angles)])  # an ellipse, [n, d]
>>> curvatures = gramian.cloud(points).curvatures()
>>> curvatures.mean_curvatures.shape, curvatures.mean_curvatures[0].round(1)  # 2 at the tip: axis/(other axis)²
((100,), np.float64(2.0))

`cloud` registers points with the service at `GRAMIAN_URL`, or else with one that it starts on this machine.
`Client` stands for a service at any address, with all options. `Cloud` stands for a registered cloud of points,
with a method for each operation. Answers are NumPy arrays in dataclasses (`gramian.answers`). Refusals are
exceptions (`Problem`).
`gramian.rest` is the complete client, generated from the service's OpenAPI document (in a clone, by
`sdk/python/generate`).
"""

import copyreg

from .answers import (
    AlphaPath,
    Curvatures,
    Interpolation,
    InterpolationBatch,
    LaplaceBeltrami,
    LaplaceBeltramiMatrix,
    LaplaceBeltramiSparseMatrix,
    LeaveOneOut,
    Mesh,
    ModelSelection,
    Normals,
    Posterior,
    PosteriorBatch,
    SurfaceGradient,
    SurfaceGradientMatrix,
    SurfaceGradientSparseMatrix,
)
from .arguments.fit import Fit, Kernel, KernelFields, KernelLike, Surface, SurfaceFields, SurfaceLike, ValuesFit
from .arguments.options import (
    InterpolationOptions,
    MeshOptions,
    OperatorFit,
    OperatorOptions,
    PosteriorOptions,
    SurfaceFit,
    SurfaceOperatorFit,
    SurfaceOptions,
)
from .client import Client
from .resources.cloud import Cloud
from .resources.selection import Bounds, FreeParameterFields, Vary
from .rest.models import (
    Diagnostics,
    DuplicatePolicy,
    FactorizationUsed,
    FamilyScore,
    Flag,
    FlagReason,
    FreeParameter,
    GeometryAttribute,
    KernelDescription,
    KernelFamily,
    KernelUsed,
    MeshAttribute,
    MeshPart,
    MeshQuality,
    OrientationChoice,
    PosteriorQuantity,
    SelectionCriterion,
    SelectionParameter,
    Smoothness,
    SolverChoice,
    SolverUsed,
    SurfaceModelChoice,
    SurfaceModelUsed,
    WarningCode,
)
from .rest.types import UNSET, Unset
from .service import cloud, local
from .wire.problems import NotPositiveDefinite, Overloaded, Problem, UnknownCloud

# The generated code compares with the identity of UNSET. Pickling or copying an answer must keep that
# identity.
copyreg.pickle(Unset, lambda _: "UNSET")

__all__ = [
    "UNSET",
    "AlphaPath",
    "Bounds",
    "Client",
    "Cloud",
    "Curvatures",
    "Diagnostics",
    "DuplicatePolicy",
    "FactorizationUsed",
    "FamilyScore",
    "Fit",
    "Flag",
    "FlagReason",
    "FreeParameter",
    "FreeParameterFields",
    "GeometryAttribute",
    "Interpolation",
    "InterpolationBatch",
    "InterpolationOptions",
    "Kernel",
    "KernelDescription",
    "KernelFamily",
    "KernelFields",
    "KernelLike",
    "KernelUsed",
    "LaplaceBeltrami",
    "LaplaceBeltramiMatrix",
    "LaplaceBeltramiSparseMatrix",
    "LeaveOneOut",
    "Mesh",
    "MeshAttribute",
    "MeshOptions",
    "MeshPart",
    "MeshQuality",
    "ModelSelection",
    "Normals",
    "NotPositiveDefinite",
    "OperatorFit",
    "OperatorOptions",
    "OrientationChoice",
    "Overloaded",
    "Posterior",
    "PosteriorBatch",
    "PosteriorOptions",
    "PosteriorQuantity",
    "Problem",
    "SelectionCriterion",
    "SelectionParameter",
    "Smoothness",
    "SolverChoice",
    "SolverUsed",
    "Surface",
    "SurfaceFields",
    "SurfaceFit",
    "SurfaceGradient",
    "SurfaceGradientMatrix",
    "SurfaceGradientSparseMatrix",
    "SurfaceLike",
    "SurfaceModelChoice",
    "SurfaceModelUsed",
    "SurfaceOperatorFit",
    "SurfaceOptions",
    "UnknownCloud",
    "Unset",
    "ValuesFit",
    "Vary",
    "WarningCode",
    "cloud",
    "local",
]
