"""Options of a fit that the service used, from an answer and its request: `**answer.fit` repeats the fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments.fit import Surface, ValuesFit
from ..arguments.options import OperatorFit, SurfaceFit
from ..rest.models import (
    Diagnostics,
    DuplicatePolicy,
    KernelUsed,
    MeanChoice,
    SolverChoice,
    SolverUsed,
    SurfaceModelChoice,
)
from ..rest.types import Unset
from ..wire.tensors import Array, Members


def surface_fit_used(members: Members) -> SurfaceFit:
    """Returns the fit of a surface that the service used, ready to be sent again."""
    fit = _reported_fit(members)
    # Local regressions learn them by likelihood, and refuse them in requests.
    if members.diagnostics.solver is SolverUsed.LOCAL:
        fit.pop("kernel", None)
        fit.pop("alpha", None)
        fit.pop("noise_variances", None)
    return fit


def values_fit_used(members: Members) -> OperatorFit:
    """Returns the fit of values that the service used, ready to be sent again, with the mean if there is one.

    Unlike for surfaces, the local solver for values takes a kernel, so the kernel is kept.
    """
    fit = _reported_fit(members)
    coefficients = members.diagnostics.mean_coefficients
    # Batches: [n_lists, n_coefficients]. The last axis tells constant from linear.
    if "mean_coefficients" in members:
        coefficients = members["mean_coefficients"]
    if not isinstance(coefficients, Unset):
        fit["mean"] = MeanChoice.CONSTANT if np.shape(coefficients)[-1] == 1 else MeanChoice.LINEAR
    return fit


def selected_fit(members: Members) -> ValuesFit:
    """Returns the selected fit: kernel and α found by the search, the other options as used."""
    fit = values_fit_used(members)
    fit["kernel"] = KernelUsed.from_dict(members["kernel"])
    if "alpha" in members:
        fit["alpha"] = members["alpha"]
    return fit


def operator_fit_used(members: Members) -> OperatorFit:
    """Returns the fit of values that the service used, ready to be sent again, with the fit of the surface."""
    fit, surface = values_fit_used(members), members.diagnostics.surface
    # Stencils fit nothing to the values, so the diagnostics are those of the surface.
    if isinstance(surface, Unset):
        surface = members.diagnostics
        fit = OperatorFit(solver=SolverChoice.LOCAL, **_unreported(members.request))
    if surface.solver is SolverUsed.LOCAL:
        # The service chose kernel and noise from the values. Leaving them out repeats that choice.
        fit.pop("kernel", None)
        fit.pop("alpha", None)
    return OperatorFit(**fit, surface=_surface_used(members.request, surface))


def _surface_used(request: Mapping[str, Any], surface: Diagnostics) -> Surface:
    """Returns the options of the surface as used. They replace those that the request left out."""
    asked = request.get("surface", {})
    used = Surface(
        cloud=None if surface.cloud_id == request["cloud"]["id"] else surface.cloud_id,
        solver=surface.solver,
        model=SurfaceModelChoice(asked["model"]) if "model" in asked else None,
    )
    if surface.solver is SolverUsed.LOCAL:
        return used
    # No α in the diagnostics: each point had its own noise.
    if isinstance(surface.alpha, Unset):
        # A surface without noise variances takes those of the values.
        noise_variances = asked.get("noise_variances", request.get("noise_variances"))
        return replace(used, kernel=surface.kernel, noise_variances=_own_copy(noise_variances))
    return replace(used, kernel=surface.kernel, alpha=surface.alpha)


def _reported_fit(members: Members) -> OperatorFit:
    """Returns kernel, solver and noise from the diagnostics.

    Options that diagnostics do not report come from the request.
    """
    diagnostics, request = members.diagnostics, members.request
    fit = OperatorFit(kernel=diagnostics.kernel, solver=diagnostics.solver, **_unreported(request))
    if isinstance(diagnostics.alpha, Unset):
        fit["noise_variances"] = _own_copy(request.get("noise_variances"))
    else:
        fit["alpha"] = diagnostics.alpha
    return fit


def _unreported(request: Mapping[str, Any]) -> OperatorFit:
    """Returns the options of the request that diagnostics do not repeat."""
    fit = OperatorFit()
    if "duplicates" in request:
        fit["duplicates"] = DuplicatePolicy(request["duplicates"])
    if "tolerance" in request:
        fit["tolerance"] = request["tolerance"]
    if "hyperparameters" in request:
        fit["hyperparameters"] = request["hyperparameters"]
    return fit


def _own_copy(numbers: npt.ArrayLike | None) -> Array | None:
    """Returns a read-only float64 copy, so that later changes to the caller's array do not matter."""
    if numbers is None:
        return None
    copy = np.array(numbers, dtype=np.float64)
    copy.flags.writeable = False
    return copy
