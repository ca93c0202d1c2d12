"""The tiles of a surface, as large as what its sample says asks for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import getitem
from typing import Any

import dask
import dask.array as da
import numpy as np
from scipy.spatial import cKDTree

from .cells import graph
from .cells.parts import Part, Reach, join
from .cells.plan import PROBE_POINTS, REGRESSED, Plan
from .orientation.signs import joined
from .replicas import Replicas
from .settling import Learned, Learning, Settled, learn, orient, settle
from .tile import assemble

AROUND = {2: 24, 3: 48, 4: 96}
"""Positions that answers depend on, by dimension: regressions see 16, 30 or 50 of them, stencils 13, 38 or 88."""

GROUPS = (1, 3, 8, 24, 72, 216, 648)
"""Points of which regressions take means, where there is noise: numerics/src/patches/mod.rs."""

LENGTH_SCALE = 1.4
"""That of the heights, in units of the radius of a neighbourhood: numerics/src/patches/pooled.rs."""

MARGIN = 1.2
"""By how much more a neighbourhood of points may seem to have before it is one of means."""

WORTH = 0.85
"""What deviations of curvatures by means must be at most, over those by points, for tiles to regress on means.

The service takes 0.95. What lies between depends on which points a mean happens to be of, and no sample tells.
"""

MORE = (48, 64, 96, 160, 320)
"""Positions around each site that tiles carry instead, one after the other, while they learn something else."""

MAX_AROUND = 2500
"""Those at most: a quarter of a million points that each tile carries."""


@dataclass(frozen=True)
class SurfaceTiles:
    """Delayed: a `Settled` tile for each cell, and the `Sides` of its regions."""

    tiles: list[Any]
    sides: list[Any]

    @classmethod
    def of(cls, replicas: Replicas, points: da.Array, plan: Plan) -> SurfaceTiles:
        """Asks what regressions learn from the sample, now, and lays the tiles out for it.

        Raises
        ------
        ValueError
            If the dimension is not 2, 3 or 4.
        """
        if plan.dimension not in AROUND:
            raise ValueError(f"surfaces in tiles have 2, 3 or 4 coordinates, not {plan.dimension}")
        learned, factor = decide(replicas, plan)
        first = (REGRESSED[plan.dimension] + 2) * factor
        counts = [first, *[count for count in MORE if count > first]]
        plan = plan.reaching(points, min(first, MAX_AROUND))
        carried, *more = [join([plan.around_sites(count), plan.extremes]) for count in counts]
        learning = Learning(orient(plan.coarse, learned.noise), learned, plan.sites, more)
        cores = graph.cores(points, plan)
        rims = graph.rims(cores, plan, Reach(AROUND[plan.dimension] * factor))
        shared, how = dask.delayed(carried, pure=True), dask.delayed(learning, pure=True)
        build, settled = dask.delayed(assemble, pure=True), dask.delayed(settle, pure=True)
        tiles = [build(cell, core, rims[cell], shared) for cell, core in enumerate(cores)]
        ready = [settled(replicas, tile, how) for tile in tiles]
        return cls(ready, sides(ready))


def sides(tiles: list[Any]) -> list[Any]:
    """Joins the regions of settled tiles; only what they say of one another travels."""
    attribute, share = dask.delayed(getattr, pure=True), dask.delayed(Settled.shared, pure=True)
    regions = [attribute(tile, "regions") for tile in tiles]
    halos = dask.delayed(list, pure=True)([attribute(of_tile, "halo") for of_tile in regions])
    of_all = dask.delayed(joined, pure=True)(regions, [share(tile, halos) for tile in tiles])
    of_cell = dask.delayed(getitem, pure=True)
    return [of_cell(of_all, cell) for cell in range(len(tiles))]


def decide(replicas: Replicas, plan: Plan) -> tuple[Learned, int]:
    """Says what all tiles are to learn, and how many times as many points as those of points neighbourhoods reach."""
    spare = join([plan.around, plan.coarse])

    def ask(sample: Part, least: int = 0) -> Learned:
        others = spare[np.flatnonzero(~np.isin(spare.index, sample.index))]
        missing = max(min(least - len(sample), len(others)), 0)
        whole = join([sample, others[np.arange(missing)]])
        learned: Learned = dask.delayed(learn)(replicas, whole, plan.sites).compute()
        return learned

    if plan.n_points <= PROBE_POINTS:
        learned = ask(plan.around)
        group = points_per_mean(learned, plan)
        return replace(learned, are_means=group > 1), 2 * group if group > 1 else 1
    of_points = None
    for count in (REGRESSED[plan.dimension] + 2, *MORE):
        learned = ask(plan.around_sites(count))
        if points_per_mean(learned, plan) == 1:
            of_points = learned
            break
    if of_points is not None and (of_points.noise == 0 or np.isnan(of_points.deviation)):
        return of_points, 1
    least = plan.n_points
    while least > PROBE_POINTS:
        least = -(-least // 2)
    learned = ask(plan.around_sites(least // len(plan.sites)), least)
    group = points_per_mean(learned, plan)
    if of_points is not None and (group == 1 or learned.deviation > WORTH * of_points.deviation):
        return of_points, 1
    return replace(learned, are_means=True), 2 * max(group, GROUPS[1])


def points_per_mean(learned: Learned, plan: Plan) -> int:
    """Returns of how many points regressions take means, 1 for points, as the size of their neighbourhoods says."""
    if learned.noise == 0:
        return 1
    positions = plan.positions().points
    count = min(REGRESSED[plan.dimension], len(positions))
    distances = cKDTree(positions).query(plan.sites.points, [count])[0][:, 0]
    times = (learned.length_scale / LENGTH_SCALE / float(np.median(distances))) ** (plan.dimension - 1)
    return 1 if times <= MARGIN else next((group for group in GROUPS if group >= times), GROUPS[-1])
