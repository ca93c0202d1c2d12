"""What comes before all answers of a tile: the coarse cloud, and tiles that learn what the cloud would.

Where the cloud has noise the service tries means of points instead of points, and takes what promises less deviation.
Which points a mean is of differs from tile to tile, so that a tile may decide otherwise than the cloud. It is asked,
and if so is given more of the neighbourhoods that are learned from until it does not, or there are no more; then the
answers at its points say so. The replica keeps what it computed for the answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arguments.fit import Fit, Kernel
from ..client import Client
from ..cloud import Cloud
from ..wire.tensors import Array
from .cells.cut import Ints
from .cells.parts import Part
from .cells.thinning import scales
from .orientation.regions import Regions
from .replicas import Replicas
from .tile import Tile, widened

SAME = 1e-6
"""Relative difference of what is learned from points, up to rounding."""

SIMILAR = 0.25
"""That of what is learned from means, which are never the same."""


@dataclass(frozen=True)
class Learned:
    """What local regressions learn from the sample.

    Attributes
    ----------
    noise, length_scale
        σ of the points, and ℓ of the heights, L.
    deviation
        Of curvatures at the sites, in the median, 1/L; NaN where none has any.
    are_means
        Whether they regress on means of points.
    """

    noise: float
    length_scale: float
    deviation: float = np.nan
    are_means: bool = False

    def is_like(self, other: Learned) -> bool:
        """Whether another cloud has learned the same, if there is anything to learn."""
        tolerance = SIMILAR if self.are_means else SAME
        return np.isnan(self.deviation) or abs(other.length_scale - self.length_scale) <= tolerance * self.length_scale


@dataclass(frozen=True)
class Coarse:
    """A signature function of few points, by which the service says which side is outward.

    Attributes
    ----------
    part
        The points `[c, d]`.
    fit
        Kernel, α and solver.
    """

    part: Part
    fit: Fit

    def directions(self, client: Client, points: Array) -> Array:
        """Returns unit vectors outward of it at points, `[n, d]`: minus the gradient, never of length 0."""
        ones = np.ones(len(self.part))
        cloud = client.cloud(self.part.points)
        answer = cloud.interpolate(ones, points, derivatives=1, mean="zero", **self.fit)
        directions: Array = -np.asarray(answer.gradients)
        lengths = np.linalg.norm(directions, axis=1)
        directions[lengths == 0, 0] = 1
        return directions / np.where(lengths == 0, 1, lengths)[:, None]


@dataclass(frozen=True)
class Learning:
    """What tiles are to learn, and from what.

    Attributes
    ----------
    coarse
        The signature function that says which side is outward.
    learned
        What the sample said.
    sites
        Where tiles learn.
    more
        What they carry instead, one after the other, while they learn something else.
    """

    coarse: Coarse
    learned: Learned
    sites: Part
    more: Sequence[Part]


def learn(replicas: Replicas, sample: Part, sites: Part) -> Learned:
    """Asks what the neighbourhoods of the sites say of noise and size, and how surely curvatures are known there."""

    def call(client: Client) -> Learned:
        cloud = client.cloud(sample.points)
        # At points, whose noise counts.
        answer = cloud.curvatures(solver="local", deviations=True, sites=sites.points)
        at_sites = np.asarray(answer.principal_curvature_deviations)[np.searchsorted(sample.index, sites.index)]
        known = at_sites.max(axis=1)[~np.isnan(at_sites).any(axis=1)]
        deviation = float(np.median(known)) if len(known) else np.nan
        return replace(_learned(cloud, sites.points), deviation=deviation)

    return replicas.ask(0, call)


def orient(part: Part, noise: float) -> Coarse:
    """Says how the coarse cloud is fitted: as the service does for local regressions."""
    extent, spacing = scales(part.points)
    length_scale = max(0.45 * extent, 4 * spacing)
    kernel = Kernel("laplace", length_scale=length_scale, epsilon=(0.4 * spacing / length_scale) ** 2)
    return Coarse(part, Fit(solver="dense", kernel=kernel, alpha=max(1e-3, 5 * (noise / spacing) ** 1.5)))


@dataclass(frozen=True)
class Settled:
    """A tile that learns what the cloud would.

    Attributes
    ----------
    tile
        Its points.
    directions
        `[n, d]`. Unit vectors outward at these, by the coarse function.
    sites
        `[s, d]`. Where it learns, L.
    labels
        `[n]`. The region of each point, 0 for those that are neither in its cell nor in the halo.
    regions
        What they say of one another.
    is_alike
        Whether it learns what the cloud would, and not something else in spite of all that it was given.
    """

    tile: Tile
    directions: Array
    sites: Array
    labels: Ints
    regions: Regions
    is_alike: bool

    @classmethod
    def of(cls, client: Client, tile: Tile, directions: Array, learning: Learning, is_alike: bool) -> Settled:
        """Asks for normals, and finds the regions."""
        sites, coarse = learning.sites.points, learning.coarse
        normals = client.cloud(tile.points, directions).normals(solver="local", sites=sites).normals
        labels = np.zeros(len(tile.points), dtype=np.int64)
        near = np.flatnonzero(tile.is_near)
        place = np.empty(len(tile.points), dtype=np.int64)
        place[near] = np.arange(len(near))
        labels[near], regions = Regions.of(
            index=tile.index[near],
            points=tile.points[near],
            normals=np.nan_to_num(normals[near]),
            outward=directions[near],
            own=place[tile.own],
            coarse=coarse.part.index,
        )
        return cls(tile, directions, sites, labels, regions, is_alike)

    def cloud(self, client: Client) -> Cloud:
        """Returns it as a cloud of a replica, with these sides."""
        return client.cloud(self.tile.points, self.directions)

    def shared(self, halos: Sequence[Ints]) -> tuple[Ints, Ints]:
        """Returns which of its own points are in the halos of tiles, by their rows in the cloud, and their regions."""
        shared = self.tile.own[np.isin(self.tile.rows, np.concatenate(halos))]
        return self.tile.index[shared], self.labels[shared]


def settle(replicas: Replicas, tile: Tile, learning: Learning) -> Settled:
    """Prepares a tile on its replica, with more of the sample where it would learn something else without."""

    def call(client: Client) -> Settled:
        candidate, directions = tile, learning.coarse.directions(client, tile.points)
        for carried in [*learning.more, None]:
            learned = _learned(client.cloud(candidate.points, directions), learning.sites.points)
            is_alike = learning.learned.is_like(learned)
            if is_alike or carried is None:
                return Settled.of(client, candidate, directions, learning, is_alike)
            candidate = widened(tile, carried)
            directions = learning.coarse.directions(client, candidate.points)
        raise AssertionError("the last one is taken as it is")

    return replicas.ask(tile.number, call)


def _learned(cloud: Cloud, sites: Array) -> Learned:
    first = cloud.points[:1] if cloud.points is not None else None
    used = cloud.normals(first, solver="local", sites=sites).diagnostics
    return Learned(float(used.alpha or 0) ** 0.5, float(used.kernel.length_scale or 0))
