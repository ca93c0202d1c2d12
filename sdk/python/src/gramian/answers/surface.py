"""Normals and curvatures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from ..arguments.options import SurfaceFit
from ..rest.models import Diagnostics, Flag, SurfaceModelUsed
from ..wire.tensors import Array, Members
from .answer import Answer
from .asked import asked
from .fit import surface_fit_used


class SurfaceAnswer(Answer):
    """The base class of answers about a surface."""

    @classmethod
    def read(cls, members: Members, **derived: object) -> Self:
        """Reads an answer and the options of its fit."""
        return super().read(members, fit=surface_fit_used(members), **derived)

    WORDS: ClassVar = {"surface_models": tuple(model.value for model in SurfaceModelUsed)}


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Normals(SurfaceAnswer):
    """Unit normals of the surface at the queries. `std=True` asks for deviations.

    Attributes
    ----------
    normals
        `[m, d]`, of length 1, outward unless requested otherwise.
    gradient_norms
        `[m]`. |∇u| of the function in `surface_models`: 1/L for `signature`, about 1 for `offset`, 1 for `regression`.
    levels
        `[m]`. The signature function: 1 on the surface, usually greater inside a closed one.
    surface_models
        m entries. The function whose level set was used.
    normal_std
        `[m]`, radians. Standard deviation σ of the angle of the normal: 95 % of the angles are below 1.96 σ.
        NaN where it is unknown.
    edge_normals
        `[m, 2, d]`. Normals of the two sheets at queries on a sharp edge, NaN elsewhere, with
        `include="edge_normals"`.
    flags
        The queries without a normal, or with a doubtful one.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    normals: Array
    gradient_norms: Array
    levels: Array
    surface_models: tuple[SurfaceModelUsed, ...]
    normal_std: Array = asked("std=True")
    edge_normals: Array = asked('include="edge_normals"')
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: SurfaceFit

    SUMMARY: ClassVar = ("normal_std", "levels")


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Curvatures(SurfaceAnswer):
    """Curvatures of the surface at the queries.

    With outward normals, a sphere of radius r has +1/r everywhere. `std=True` asks for deviations.

    Attributes
    ----------
    principal_curvatures
        `[m, d − 1]`, 1/L, ascending.
    principal_directions
        `[m, d − 1, d]`, of length 1, the largest component positive. An arbitrary basis where curvatures
        coincide.
    mean_curvatures
        `[m]`, 1/L. The average of the principal curvatures.
    gaussian_curvatures
        `[m]`, 1/L^(d − 1). The product of the principal curvatures.
    normals
        `[m, d]`, of length 1.
    gradient_norms
        `[m]`. |∇u| of the function in `surface_models`: 1/L for `signature`, about 1 for `offset`, 1 for `regression`.
    levels
        `[m]`. The signature function: 1 on the surface, usually greater inside a closed one.
    surface_models
        m entries. The function whose level set was used.
    normal_std
        `[m]`, radians. Standard deviation σ of the angle of the normal: 95 % of the angles are below 1.96 σ.
        NaN where it is unknown.
    principal_curvature_std
        `[m, d − 1]`, 1/L. Standard deviations of the principal curvatures.
    mean_curvature_std
        `[m]`, 1/L. Standard deviations of the mean curvatures.
    gaussian_curvature_std
        `[m]`, 1/L^(d − 1). Standard deviations of the Gaussian curvatures.
    edge_normals
        `[m, 2, d]`. Normals of the two sheets at queries on a sharp edge, NaN elsewhere, with
        `include="edge_normals"`.
    flags
        The queries without curvatures, or with doubtful ones.
    diagnostics
        The kernel and α used, how the system was solved, and how well.
    fit
        All options of the fit, as used. `**answer.fit` in a call repeats the fit.
    """

    principal_curvatures: Array
    principal_directions: Array
    mean_curvatures: Array
    gaussian_curvatures: Array
    normals: Array
    gradient_norms: Array
    levels: Array
    surface_models: tuple[SurfaceModelUsed, ...]
    normal_std: Array = asked("std=True")
    principal_curvature_std: Array = asked("std=True")
    mean_curvature_std: Array = asked("std=True")
    gaussian_curvature_std: Array = asked("std=True")
    edge_normals: Array = asked('include="edge_normals"')
    flags: tuple[Flag, ...]
    diagnostics: Diagnostics
    fit: SurfaceFit

    SUMMARY: ClassVar = ("mean_curvatures", "gaussian_curvatures")
