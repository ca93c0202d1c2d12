"""Values kriged from the nearest points, with one kernel, noise and mean for all tiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import dask.array as da
import numpy as np

from ..answers import Interpolation
from ..arguments.fit import Kernel, ValuesFit
from ..client import Client
from ..rest.models import KernelUsed
from ..rest.types import Unset
from ..tiles.operations import choose_coarse
from ..tiles.replicas import Replicas
from ..wire.tensors import Array
from .cells.graph import Rows
from .cells.parts import Part, Reach, join
from .cells.plan import Plan, nearest_to

NEIGHBOURS = 128
"""Number of points from which the service kriges each query."""

N_CENTRES = 16
TOGETHER = 16
"""Groups of points, and points of each, from whose values a kernel is learned."""


@dataclass(frozen=True)
class Law:
    """The process that values come from."""

    kernel: Kernel | KernelUsed
    alpha: float
    mean: Array  # [0, 1 or d + 1]: the constant, V, and a slope for each coordinate, V/L

    @classmethod
    def of(cls, replicas: Replicas, plan: Plan, arrays: tuple[da.Array, da.Array], fit: ValuesFit) -> Law:
        """Takes what is given, and learns the rest now, from at most 256 of the points and values."""
        if given := cls.given(fit):
            return given
        points, all_values = arrays

        def centres(client: Client) -> Array:
            return plan.sample.points[choose_coarse(client, plan.sample.points, count=N_CENTRES)[0]]

        near = nearest_to(replicas.ask(0, centres), points, Reach(TOGETHER, are_distinct=False))
        values = all_values[near.index].compute()

        def call(client: Client) -> Law:
            used = client.cloud(near.points).posterior(values, near.points[:1], **fit).diagnostics
            mean = [] if isinstance(used.mean_coefficients, Unset) else used.mean_coefficients
            return cls(used.kernel, float(used.alpha or 0), np.array(mean, dtype=np.float64))

        return replicas.ask(0, call)

    @classmethod
    def given(cls, fit: ValuesFit) -> Law | None:
        """Returns what is given if nothing is left to ask for: a length scale, alpha, and no mean."""
        kernel, alpha = fit.get("kernel"), fit.get("alpha")
        if isinstance(kernel, Mapping):
            kernel = Kernel(**kernel)
        if not isinstance(kernel, Kernel | KernelUsed) or alpha is None or isinstance(alpha, Unset):
            return None
        scales = [kernel.length_scale, kernel.length_scales]
        if fit.get("mean") not in (None, "zero") or all(scale is None or isinstance(scale, Unset) for scale in scales):
            return None
        return cls(kernel, float(alpha), np.empty(0))

    def mean_at(self, points: Array) -> Array:
        """Returns the mean at points, `[n]`."""
        basis = np.column_stack([np.ones(len(points)), points])
        at_points: Array = basis[:, : len(self.mean)] @ self.mean
        return at_points

    @property
    def reach(self) -> Reach:
        """Which points kriging looks at: the nearest ones as a kernel with a length scale for each axis measures."""
        scales = self.kernel.length_scales
        if scales is None or isinstance(scales, Unset):
            return Reach(NEIGHBOURS, are_distinct=False)
        return Reach(NEIGHBOURS, are_distinct=False, stretch=tuple(min(scales) / scale for scale in scales))


@dataclass(frozen=True)
class Kriging:
    """The request for every tile."""

    law: Law
    derivatives: int  # 0, 1 or 2
    std: bool

    def kinds(self, dimension: int) -> dict[str, Array]:
        """Returns empty arrays of the shapes of the answers, by name."""
        shapes = {"values": (), "gradients": (dimension,), "hessians": (dimension, dimension)}
        names = list(shapes)[: self.derivatives + 1]
        kinds = {name: np.empty((0, *shapes[name])) for name in names}
        if self.std:
            kinds |= {f"{name[:-1]}_std": np.empty((0, *shapes[name])) for name in names}
        return kinds

    def krige(self, replicas: Replicas, number: int, core: Part, rims: Sequence[Part], queries: Part) -> Rows:
        """Asks for the function at the queries of a cell, from the points of the cell and its rims."""
        if len(queries) == 0:
            return {}
        tile, law = join([core, *rims]), self.law
        left = np.asarray(tile.values) - law.mean_at(tile.points)

        def call(client: Client) -> Interpolation:
            return client.cloud(tile.points).interpolate(
                left,
                queries.points,
                derivatives=self.derivatives,
                std=self.std,
                kernel=law.kernel,
                alpha=law.alpha,
                mean="zero",
                solver="local",
            )

        answer = replicas.ask(number, call)
        rows: Rows = {name: array for name, array in vars(answer).items() if isinstance(array, np.ndarray)}
        rows["values"] = answer.values + law.mean_at(queries.points)
        if hasattr(answer, "gradients") and len(law.mean) > 1:
            rows["gradients"] = answer.gradients + law.mean[1:]
        return rows | {"index": queries.index}
