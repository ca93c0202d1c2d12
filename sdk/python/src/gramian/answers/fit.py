"""Options of a fit as they were used, from an answer and its request: `**answer.fit` repeats the fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments.fit import Geometry, ValuesFit
from ..arguments.options import OperatorFit, SurfaceFit
from ..rest.models import (
    Diagnostics,
    DuplicatePolicy,
    KernelUsed,
    MeanChoice,
    SolverChoice,
    SolverUsed,
    SurfaceChoice,
)
from ..rest.types import Unset
from ..wire.tensors import Array, Members


def surface_fit_used(members: Members) -> SurfaceFit:
    """Returns the fit of a surface as used."""
    fit = _numbers_used(members)
    if members.diagnostics.solver is SolverUsed.LOCAL:  # local regressions choose these by likelihood, and take none
        fit.pop("kernel", None)
        fit.pop("alpha", None)
        fit.pop("noise_variances", None)
    return fit


def values_fit_used(members: Members) -> OperatorFit:
    """Returns the fit of values as used, with the mean if there is one.

    Unlike for surfaces, the local solver for values takes a kernel, so the kernel is kept.
    """
    fit = _numbers_used(members)
    coefficients = members.diagnostics.mean_coefficients
    if "mean_coefficients" in members:  # a row for each of many lists
        coefficients = members["mean_coefficients"]
    if not isinstance(coefficients, Unset):
        fit["mean"] = MeanChoice.CONSTANT if np.shape(coefficients)[-1] == 1 else MeanChoice.LINEAR
    return fit


def selected_fit(members: Members) -> ValuesFit:
    """Returns the fit with which a search ended, from the one with which it began."""
    fit = values_fit_used(members)
    fit["kernel"] = KernelUsed.from_dict(members["kernel"])
    if "alpha" in members:
        fit["alpha"] = members["alpha"]
    return fit


def operator_fit_used(members: Members) -> OperatorFit:
    """Returns the fit of values as used, with the fit of the surface."""
    fit, surface = values_fit_used(members), members.diagnostics.geometry
    if isinstance(surface, Unset):  # by stencils, which fit nothing to the values
        surface = members.diagnostics
        fit = OperatorFit(solver=SolverChoice.LOCAL, **_unreported(members.request))
    if surface.solver is SolverUsed.LOCAL:
        # A local surface takes no kernel, not even that of the values. So the service chose the kernel of the
        # values, and will choose it again.
        fit.pop("kernel", None)
        fit.pop("alpha", None)
    return OperatorFit(**fit, geometry=_geometry_used(members.request, surface))


def _geometry_used(request: Mapping[str, Any], surface: Diagnostics) -> Geometry:
    asked = request.get("geometry", {})
    geometry = Geometry(
        cloud=None if surface.cloud_id == request["cloud"]["id"] else surface.cloud_id,
        solver=surface.solver,
        surface=SurfaceChoice(asked["surface"]) if "surface" in asked else None,
    )
    if surface.solver is SolverUsed.LOCAL:
        return geometry
    if isinstance(surface.alpha, Unset):
        noise_variances = asked.get("noise_variances", request.get("noise_variances"))
        return replace(geometry, kernel=surface.kernel, noise_variances=_own_copy(noise_variances))
    return replace(geometry, kernel=surface.kernel, alpha=surface.alpha)


def _numbers_used(members: Members) -> OperatorFit:
    diagnostics, request = members.diagnostics, members.request
    fit = OperatorFit(kernel=diagnostics.kernel, solver=diagnostics.solver, **_unreported(request))
    if isinstance(diagnostics.alpha, Unset):
        fit["noise_variances"] = _own_copy(request.get("noise_variances"))
    else:
        fit["alpha"] = diagnostics.alpha
    return fit


def _unreported(request: Mapping[str, Any]) -> OperatorFit:
    """Returns the given options of which diagnostics say nothing."""
    fit = OperatorFit()
    if "duplicates" in request:
        fit["duplicates"] = DuplicatePolicy(request["duplicates"])
    if "hyperparameters" in request:
        fit["hyperparameters"] = request["hyperparameters"]
    return fit


def _own_copy(numbers: npt.ArrayLike | None) -> Array | None:
    """Returns a read-only copy of numbers, which the caller cannot change."""
    if numbers is None:
        return None
    copy = np.array(numbers, dtype=np.float64)
    copy.flags.writeable = False
    return copy
