"""Operations that only clouds in tiles need."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..arguments.fit import Fit
from ..arguments.normalise import REQUEST, Rule
from ..client import Client
from ..resources.cloud import Cloud
from ..rest.models import CoarseResponse, Hyperparameters, SidesResponse
from ..wire.tensors import JSON, Array, Integers, Members

REGIONS: Mapping[str, Rule] = {
    **REQUEST,
    "own": lambda _, value, __: np.asarray(value).tolist(),
    "coarse": lambda _, value, __: np.asarray(value).tolist(),
}


def choose_coarse(client: Client, points: Array, **options: float) -> tuple[Integers, Fit]:
    """Chooses points that are spread as the cloud is, with kernel and alpha of their signature function."""
    connection = client._connection
    response = connection.post("/v1/tiles/coarse", {"points": points, **options}, JSON)
    found = connection.read(CoarseResponse.from_dict, response)
    fit = Fit(solver="dense", kernel=found.kernel, alpha=found.alpha)
    return np.array(found.points, dtype=np.int64), fit


def find_regions(
    cloud: Cloud, own: Integers, coarse: Integers, hyperparameters: Hyperparameters
) -> tuple[Integers, dict[str, Any]]:
    """Finds the regions of a tile: the region of each point, `[n]`, and what is said of the regions."""

    def read(members: Members, **_: object) -> tuple[Integers, dict[str, Any]]:
        regions = {name: members[name] for name in ("regions", "borders", "n_edges")}
        return np.asarray(members["labels"], dtype=np.int64), regions

    return cloud._compute(
        read, "/v1/tiles/regions", REGIONS, solver="local", own=own, coarse=coarse, hyperparameters=hyperparameters
    )


def choose_sides(client: Client, tiles: list[dict[str, Any]], links: Integers) -> tuple[Array, Any]:
    """Chooses the sides of the regions of all tiles: signs, `[r]`, and whether they are doubtful, `[r]`."""
    connection = client._connection
    pairs = [{"first": first, "second": second} for first, second in links.tolist()]
    response = connection.post("/v1/tiles/sides", {"tiles": tiles, "links": pairs}, JSON)
    found = connection.read(SidesResponse.from_dict, response)
    return np.array(found.signs, dtype=np.float64), np.array(found.are_doubtful, dtype=bool)
