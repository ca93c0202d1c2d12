"""Clouds that the service knows, and may forget."""

from __future__ import annotations

from collections.abc import Mapping

import numpy.typing as npt

from .fit import as_rows, given
from .problems import UnknownCloud
from .rest import models
from .tensors import JSON, Array, Members
from .transport import Connection


class RegisteredCloud:
    """The part of `Cloud` that concerns its life: what it is, and how it is posted, posted again and deleted."""

    def __init__(
        self,
        connection: Connection,
        description: models.Cloud,
        points: Array | None = None,
        normals: Array | None = None,
    ) -> None:
        """Takes what the service said of the cloud; `Client.cloud` and `Client.clouds` make clouds."""
        self._connection = connection
        self.description = description
        self._points = points
        self._normals = normals

    def __repr__(self) -> str:
        return f"Cloud(id='{self.id[:8]}…', n_points={self.n_points}, dimension={self.dimension})"

    @property
    def id(self) -> str:
        """64 hexadecimal digits."""
        return self.description.cloud_id

    @property
    def n_points(self) -> int:
        """The number of points, n."""
        return self.description.n_points

    @property
    def dimension(self) -> int:
        """The number of coordinates of each point, d."""
        return self.description.dimension

    @property
    def points(self) -> Array | None:
        """`[n, d]`, read-only; None if the cloud was not made from points."""
        return self._points

    @property
    def normals_given(self) -> Array | None:
        """`[n, d]`, read-only: the normals that the cloud was made with, whose side is outward."""
        return self._normals

    def delete(self) -> None:
        """Makes the service forget the points and all that was computed from them; no matter if it has already."""
        try:
            self._connection.send("DELETE", f"/v1/clouds/{self.id}")
        except UnknownCloud:
            return

    def _compute(self, path: str, request: Mapping[str, object], other: RegisteredCloud | None = None) -> Members:
        """Asks for something about this cloud and perhaps another one.

        Where the service has forgotten a cloud, both are posted again if their points are at hand, and the request is
        repeated once: the ids in it are still right.
        """
        request = {"cloud": {"id": self.id}, **request}
        try:
            return self._connection.compute(path, request)
        except UnknownCloud:
            if not self._post_again(self, other):
                raise
        return self._connection.compute(path, request)

    def _post_again(self, *clouds: RegisteredCloud | None) -> bool:
        """Posts those clouds whose points are at hand, and says whether there was one."""
        kept = [(cloud._points, cloud._normals) for cloud in clouds if cloud is not None]
        posted = [register(self._connection, points, normals) for points, normals in kept if points is not None]
        return bool(posted)


def register(connection: Connection, points: Array, normals: Array | None) -> models.Cloud:
    """Posts points, and says what the service knows of them."""
    request = given(points=points, normals=normals)
    return models.Cloud.from_dict(connection.post("/v1/clouds", request, accept=JSON).json())


def own_copy(name: str, rows: npt.ArrayLike) -> Array:
    """Returns a read-only copy of points: the caller may change theirs, and these must stay as their id says."""
    array = as_rows(name, rows).copy()  # always: arrays of other libraries hand out their own buffer
    array.flags.writeable = False
    return array
