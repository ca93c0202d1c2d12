"""The surface of a cloud in tiles: decisions for the whole cloud, and requests for each tile.

Noise and shape are learned around sites all over the cloud, and a coarse cloud says which side is outward. Each
tile gets both. It finds regions in which its normals agree, and the regions of all tiles are joined in one place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import getitem
from typing import Any, TypeAlias, cast

import dask
import dask.array as da
import numpy as np

from ..arguments.fit import Fit
from ..client import Client
from ..rest.models import Hyperparameters
from ..tiles.operations import choose_coarse, choose_sides, find_regions
from ..tiles.replicas import Replicas
from ..wire.tensors import Array
from .cells import graph
from .cells.cut import Ints
from .cells.parts import Part, Reach, join
from .cells.plan import Plan, nearest_to

PROBE_POINTS = 60_000
"""Most points of the cloud from which tiles learn. A smaller cloud is learned from as a whole."""


@dataclass(frozen=True)
class Whole:
    """What all tiles of a surface share."""

    hyperparameters: Hyperparameters  # what local regressions learned
    reach: int  # how many positions around a point its answers depend on
    coarse: Part  # the coarse cloud, which determines the outward side
    fit: Fit  # of its signature function

    @classmethod
    def learned(cls, replicas: Replicas, plan: Plan, points: da.Array) -> Whole:
        """Asks a replica what it learns around the sites, and for the coarse cloud."""
        sample = probe(plan, points)

        def call(client: Client) -> Whole:
            cloud = client.cloud(sample.points)
            learned = cloud.normals(sample.points[:1], solver="local", sites=plan.sites.points).diagnostics
            known = cast("Hyperparameters", learned.hyperparameters)  # local regressions always have them
            coarse, fit = choose_coarse(client, plan.sample.points, noise_deviation=known.noise_deviation)
            return cls(known, cast("int", learned.reach), plan.sample[coarse], fit)

        return replicas.ask(0, call)

    def directions(self, client: Client, points: Array) -> Array:
        """Computes directions outward by the coarse cloud, `[n, d]`: minus the gradient, never of length 0."""
        cloud = client.cloud(self.coarse.points)
        answer = cloud.interpolate(np.ones(len(self.coarse)), points, derivatives=1, mean="zero", **self.fit)
        directions: Array = -np.asarray(answer.gradients)
        directions[(directions == 0).all(axis=1), 0] = 1
        return directions


def probe(plan: Plan, points: da.Array) -> Part:
    """Returns the part of the cloud to learn from: whole neighbourhoods of the sites, and the bounding box.

    It has as many points as repeated halving of the cloud leaves, so that means of its points are means of as many
    as those of the cloud.
    """
    if plan.n_points <= PROBE_POINTS:
        return plan.sample
    size = plan.n_points
    while size > PROBE_POINTS:
        size = -(-size // 2)
    around = nearest_to(plan.sites.points, points, Reach(size // len(plan.sites)))
    chosen = join([plan.sites, around, plan.extremes])
    others = plan.sample[np.flatnonzero(~np.isin(plan.sample.index, chosen.index))]
    missing = min(max(size - len(chosen), 0), len(others))
    return join([chosen, others[np.arange(missing) * len(others) // max(missing, 1)]])


@dataclass(frozen=True)
class SurfaceTile:
    """A tile with the points around it, and the regions of its surface."""

    number: int  # of its cell
    part: Part  # its points, and those that its answers depend on
    own: Ints  # [m]: places of the points of the cell in `part`
    directions: Array  # [n, d]: outward by the coarse cloud
    labels: Ints  # [n]: the region of each point, or −1
    regions: dict[str, Any]  # the answer of the service for the regions

    @property
    def rows(self) -> Ints:
        """Rows in the cloud of the points of the cell, `[m]`, ascending."""
        return self.part.index[self.own]

    def labelled(self, rows: Ints | None = None) -> tuple[Ints, Ints]:
        """Returns points that have a region, by their rows in the cloud, with these regions.

        They are the points around the cell, or those of the cell among `rows`.
        """
        is_own = np.isin(np.arange(len(self.part)), self.own)
        wanted = ~is_own if rows is None else is_own & np.isin(self.part.index, rows)
        places = np.flatnonzero(wanted & (self.labels >= 0))
        return self.part.index[places], self.labels[places]


def prepare(replicas: Replicas, number: int, core: Part, rims: Sequence[Part], whole: Whole) -> SurfaceTile:
    """Puts a tile together, and asks for its regions. The replica keeps what it computed for the answers."""
    part = join([core, *rims])
    own = np.searchsorted(part.index, core.index)
    coarse = np.flatnonzero(np.isin(part.index, whole.coarse.index))

    def call(client: Client) -> SurfaceTile:
        directions = whole.directions(client, part.points)
        cloud = client.cloud(part.points, directions)
        labels, regions = find_regions(cloud, own, coarse, whole.hyperparameters)
        return SurfaceTile(number, part, own, directions, labels, regions)

    if len(core) == 0:
        return SurfaceTile(number, core, own, core.points, own, {"regions": [], "borders": [], "n_edges": 0})
    return replicas.ask(number, call)


Sides: TypeAlias = tuple[Array, Any]
"""Of the regions of a tile: signs, 1 or −1, `[r]`, and whether the sides are doubtful, `[r]`."""


def joined(replicas: Replicas, tiles: list[Any], inner: list[Any], outer: list[Any]) -> list[Sides]:
    """Asks for the sides of the regions of all tiles.

    `inner` and `outer` are points of each tile with their regions: its own that others see, and those of others that
    it sees.
    """
    firsts = np.cumsum([0, *[len(tile["regions"]) for tile in tiles]])
    rows = np.concatenate([rows for rows, _ in (*inner, *outer)])
    pairs = zip((*inner, *outer), (*firsts[:-1], *firsts[:-1]), strict=True)
    numbers = np.concatenate([labels + first for (_, labels), first in pairs])
    order = np.lexsort((numbers, rows))
    is_same = np.diff(rows[order]) == 0
    links = np.column_stack([numbers[order][:-1], numbers[order][1:]])[is_same]
    signs, are_doubtful = replicas.ask(0, lambda client: choose_sides(client, tiles, np.unique(links, axis=0)))
    return [(signs[first:last], are_doubtful[first:last]) for first, last in pairwise(firsts.tolist())]


@dataclass(frozen=True)
class SurfaceTiles:
    """A `SurfaceTile` for each cell, and its `Sides`, delayed."""

    whole: Whole
    tiles: list[Any]
    sides: list[Any]

    @classmethod
    def of(cls, replicas: Replicas, points: da.Array, plan: Plan) -> SurfaceTiles:
        """Asks what the cloud learns, now, and lays the tiles out for it.

        Raises
        ------
        ValueError
            If the dimension is not 2, 3 or 4.
        """
        if plan.dimension not in (2, 3, 4):
            raise ValueError(f"surfaces in tiles have 2, 3 or 4 coordinates, not {plan.dimension}")
        whole = Whole.learned(replicas, plan, points)
        cores = graph.cores(points, plan)
        rims = graph.rims(cores, plan, Reach(whole.reach))
        shared, make = dask.delayed(whole, pure=True), dask.delayed(prepare, pure=True)
        tiles = [make(replicas, cell, core, rims[cell], shared) for cell, core in enumerate(cores)]
        return cls(whole, tiles, _sides(replicas, tiles))


def _sides(replicas: Replicas, tiles: list[Any]) -> list[Any]:
    """Joins the regions of tiles. Only sums over regions and borders are sent."""
    attribute, labelled = dask.delayed(getattr, pure=True), dask.delayed(SurfaceTile.labelled, pure=True)
    outer = [labelled(tile) for tile in tiles]
    seen = dask.delayed(np.concatenate, pure=True)([of_tile[0] for of_tile in outer])
    inner = [labelled(tile, seen) for tile in tiles]
    regions = [attribute(tile, "regions") for tile in tiles]
    of_all = dask.delayed(joined, pure=True)(replicas, regions, inner, outer)
    of_cell = dask.delayed(getitem, pure=True)
    return [of_cell(of_all, cell) for cell in range(len(tiles))]
