"""Values kriged from the nearest points, with one kernel, noise and mean for all tiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..answers import Interpolation
from ..arguments.fit import Kernel, ValuesFit
from ..client import Client
from ..rest.models import KernelUsed
from ..rest.types import Unset
from ..wire.tensors import Array
from .cells.parts import Part, Reach, join
from .replicas import Replicas
from .requests import Rows

NEIGHBOURS = 128
"""Points that the service kriges each query from."""


@dataclass(frozen=True)
class Law:
    """The process that values come from.

    Attributes
    ----------
    kernel, alpha
        As they are sent.
    mean
        `[0, 1 or d + 1]`. The constant, V, and a slope for each coordinate, V/L.
    """

    kernel: Kernel | KernelUsed
    alpha: float
    mean: Array

    def mean_at(self, points: Array) -> Array:
        """Returns the mean at points, `[n]`."""
        if len(self.mean) == 0:
            return np.zeros(len(points))
        slopes = self.mean[1:]
        at_points: Array = self.mean[0] + (points @ slopes if len(slopes) else np.zeros(len(points)))
        return at_points


def given_law(fit: ValuesFit) -> Law | None:
    """Returns what is given, if that is a length scale, α and no mean: then nothing is left to ask for."""
    kernel, alpha = fit.get("kernel"), fit.get("alpha")
    if isinstance(kernel, Mapping):
        kernel = Kernel(**kernel)
    if not isinstance(kernel, Kernel | KernelUsed) or alpha is None or isinstance(alpha, Unset):
        return None
    scales = [kernel.length_scale, kernel.length_scales]
    if fit.get("mean") not in (None, "zero") or all(scale is None or isinstance(scale, Unset) for scale in scales):
        return None
    return Law(kernel, float(alpha), np.empty(0))


def learn_law(replicas: Replicas, sample: Part, fit: ValuesFit) -> Law:
    """Asks for what is not given, from at most 256 values; they are those that the service would look at."""
    values = np.asarray(sample.values)

    def call(client: Client) -> Law:
        answer = client.cloud(sample.points).posterior(values, sample.points[:1], **fit)
        used = answer.diagnostics
        mean = [] if isinstance(used.mean_coefficients, Unset) else used.mean_coefficients
        return Law(used.kernel, float(used.alpha or 0), np.array(mean, dtype=np.float64))

    return replicas.ask(0, call)


def stretch_of(kernel: Kernel | KernelUsed) -> tuple[float, ...] | None:
    """Returns the factors by which a kernel with a length scale for each axis measures coordinates."""
    scales = kernel.length_scales
    if scales is None or isinstance(scales, Unset):
        return None
    return tuple(min(scales) / scale for scale in scales)


def krige(
    replicas: Replicas,
    number: int,
    core: Part,
    rims: Sequence[Part],
    queries: Part,
    law: Law,
    derivatives: int,
    deviations: bool,
) -> Rows:
    """Asks for the function at the queries of a cell, from the points of the cell and its rims."""
    if len(queries) == 0:
        return {}
    tile = join([core, *rims])
    left = np.asarray(tile.values) - law.mean_at(tile.points)

    def call(client: Client) -> Interpolation:
        return client.cloud(tile.points).interpolate(
            left,
            queries.points,
            derivatives=derivatives,
            deviations=deviations,
            kernel=law.kernel,
            alpha=law.alpha,
            mean="zero",
            solver="local",
        )

    answer = replicas.ask(number, call)
    rows: Rows = {name: array for name, array in vars(answer).items() if isinstance(array, np.ndarray)}
    rows["values"] = answer.values + law.mean_at(queries.points)
    if answer.gradients is not None and len(law.mean) > 1:
        rows["gradients"] = answer.gradients + law.mean[1:]
    return rows | {"index": queries.index}


def reach_of(kernel: Kernel | KernelUsed) -> Reach:
    """Returns which points a kernel's kriging looks at."""
    return Reach(NEIGHBOURS, are_distinct=False, stretch=stretch_of(kernel))
