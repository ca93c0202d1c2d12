"""Options that several methods take by name, each described once.

A method takes them as `**options: Unpack[…]`, so that type checkers and editors know their names and types.
`suggest_names` adds their descriptions to the docstring of the method, and their names to its signature.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypedDict

import numpy.typing as npt

from .fit import (
    Fit,
    GeometryWord,
    Mean,
    MeshWord,
    Number,
    Of,
    Orientation,
    Quality,
    Quantity,
    Std,
    SurfaceLike,
    SurfaceModel,
    ValuesFit,
    Whole,
)

if TYPE_CHECKING:
    from ..rest.models import Hyperparameters


class SurfaceFit(Fit, total=False):
    """Options for fitting a surface to the n points of a cloud, as keywords: `cloud.normals(**fit)`.

    Keys
    ----
    hyperparameters : Hyperparameters or dict, optional
        What local regressions have learned of the noise and the shape of the surface, as the
        `diagnostics.hyperparameters` of an answer, possibly about another cloud. Learned from the cloud if
        absent.
    """

    hyperparameters: Hyperparameters | Mapping[str, Any] | None


class SurfaceOperatorFit(SurfaceFit, total=False):
    """Options for a surface and an operator on it, without values.

    Keys
    ----
    surface : Surface, dict, Cloud or Diagnostics, optional
        The surface, if it has another cloud or fit than the values. Options absent from it are those given
        here for the values, or else as `Cloud.normals` chooses them.
    """

    surface: SurfaceLike | None


class OperatorFit(SurfaceOperatorFit, ValuesFit, total=False):
    """Options for fitting a function and a surface, as keywords: `cloud.laplace_beltrami(values, **fit)`."""


class StdOptions(TypedDict, total=False):
    """Standard deviations beside other results.

    Keys
    ----
    include : str or several, optional
        Additional results: `"std"`. Nothing if absent.
    std : bool, optional
        True for standard deviations, as by `include="std"`.
    """

    include: Std | Iterable[Std] | None
    std: bool | None


class InterpolationOptions(StdOptions, ValuesFit, total=False):
    """Options of functions through values.

    Keys
    ----
    derivatives : 0, 1 or 2, optional
        1 for gradients, 2 for Hessians as well. 0 if absent.
    """

    derivatives: Whole | None


class PosteriorOptions(ValuesFit, total=False):
    """Options of Gaussian processes.

    Keys
    ----
    include : str or several, optional
        Additional results beside the means: `"variances"`, `"observation_variances"`, `"covariance"`,
        `"gradients"`, `"gradient_variances"`, `"log_marginal_likelihood"`. Nothing if absent.
    samples : int or dict, optional
        Number of functions to draw from each posterior, jointly at all queries, or
        `{"count": 10, "seed": 1}`.
    quantiles : array_like, `[q]`, optional
        Probabilities between 0 and 1 for which to return quantiles.
    threshold : float, optional
        Threshold of `exceedance_probabilities`, V.
    of : str, optional
        What samples, quantiles and probabilities are of: the `"function"` (if absent), or an `"observation"`,
        which has the noise `alpha` as well.
    """

    include: Quantity | Iterable[Quantity] | None
    samples: Whole | Mapping[str, Whole] | None
    quantiles: npt.ArrayLike | None
    threshold: Number | None
    of: Of | None


class SurfaceOptions(SurfaceFit, total=False):
    """Options of normals and curvatures.

    Keys
    ----
    include : str or several, optional
        Additional results: `"std"`, `"edge_normals"`. Nothing if absent.
    std : bool, optional
        True for standard deviations, as by `include="std"`. They come from local regressions, unless
        `kernel`, `alpha`, `surface_model` or `solver` say otherwise.
    surface_model : str, optional
        `"signature"`, `"offset"` or `"regression"` to allow only that function. `"auto"` if absent.
    orientation : str, optional
        `"outward"` (if absent), or `"gradient"` for the side given by the gradient of u.
    """

    include: GeometryWord | Iterable[GeometryWord] | None
    std: bool | None
    surface_model: SurfaceModel | None
    orientation: Orientation | None


class MeshOptions(SurfaceFit, total=False):
    """Options of meshes.

    Keys
    ----
    surface_model : str, optional
        `"signature"` or `"regression"` to allow only that function. `"auto"` if absent.
    orientation : str, optional
        `"outward"` (if absent), or `"gradient"` for the side given by the gradient of u.
    mean : str, optional
        Mean of the function through values: `"zero"`, `"constant"` or `"linear"`. A constant if absent, or
        zero if `kernel` is given.
    step : float, optional
        Longest edge of the lattice that follows the surface, L. The median spacing of the points if absent.
    bounds : array_like, `[2, d]`, optional
        Box that the surface is followed in, its least and greatest coordinates, L. Where the cloud is if
        absent.
    quality : str, optional
        `"regular"` (if absent) for nearly equilateral triangles, `"raw"` for those that the lattice cuts.
    open : bool, optional
        True for a surface that ends where its points end. False if absent: a closed mesh bridges holes.
    include : str or several, optional
        What else is known of the vertices: `"curvatures"`, `"std"` of positions, normals and
        curvatures. Nothing if absent.
    std : bool, optional
        True for standard deviations, as by `include="std"`.
    """

    surface_model: SurfaceModel | None
    orientation: Orientation | None
    mean: Mean | None
    step: Number | None
    bounds: npt.ArrayLike | None
    quality: Quality | None
    open: bool | None
    include: MeshWord | Iterable[MeshWord] | None
    std: bool | None


class OperatorOptions(StdOptions, OperatorFit, total=False):
    """Options of operators that are applied to values."""
