"""Several servers as one service for clouds in tiles."""

from __future__ import annotations

import os
from collections.abc import Iterable

import dask.array as da
import numpy.typing as npt

from ..arguments.blocks import rows_of
from ..arguments.keywords import suggest_names
from ..client import DEFAULT_URL
from ..tiles.replicas import Replicas
from .tiles import Tiles

TILE_POINTS = 250_000
"""Points of a tile if nothing is said: some 5 s of two cores, and 25 MB on the way."""


@suggest_names
class Service:
    """Servers that answer tiles; `connect` makes one."""

    def __init__(self, replicas: Replicas) -> None:
        """Takes the addresses."""
        self.replicas = replicas

    def __repr__(self) -> str:
        return f"Service({', '.join(self.replicas.urls)})"

    def tiles(self, points: npt.ArrayLike | da.Array, n_tiles: int | None = None) -> Tiles:
        """Cuts a cloud; its points are looked at now, on Dask's scheduler, and sent when answers are computed.

        Parameters
        ----------
        points : array_like or dask.array.Array, `[n, d]`
            Rows of coordinates. A NumPy array travels with the tasks, so that one of more than some million points
            should be a Dask array that workers read by themselves, in blocks of rows.
        n_tiles : int, optional
            How many tiles; if absent, so many that each has 250,000 points or less. Servers take some million each.
        """
        array = rows_of(points)
        count = -(-len(array) // TILE_POINTS) if n_tiles is None else n_tiles
        if not 1 <= count <= len(array):
            raise ValueError(f"n_tiles must be from 1 to the number of points, {len(array)}, not {count}")
        return Tiles(self.replicas, array, count)


def connect(urls: str | Iterable[str] | None = None, *, api_key: str | None = None, timeout: float = 300.0) -> Service:
    """Says where the replicas are; nothing is sent yet.

    Each tile goes to one of them, and to the next where one does not answer. They need not know of one another, but are
    to be of one version and to be reached from Dask's workers.

    Parameters
    ----------
    urls : str or several, optional
        Their addresses; if absent that of the environment variable `GRAMIAN_URL`, or `http://127.0.0.1:8080`.
    api_key : str, optional
        A key, where they want one; if absent the environment variable `GRAMIAN_API_KEY` of each worker. One that is
        given is part of the tasks, so that Dask's scheduler and all who see its graphs have it as well.
    timeout : float, optional
        Seconds to wait for each next part of an answer; a connection is waited for 10 s at most.
    """
    given = os.environ.get("GRAMIAN_URL", DEFAULT_URL) if urls is None else urls
    addresses = (given,) if isinstance(given, str) else tuple(given)
    if not addresses:
        raise ValueError("urls has no address")
    return Service(Replicas(addresses, api_key, timeout))
