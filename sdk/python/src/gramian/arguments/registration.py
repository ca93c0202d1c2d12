"""Registration of clouds, which the service may forget."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NoReturn, TypeVar

import numpy as np

from ..rest import models
from ..wire.connection import Connection
from ..wire.problems import UnknownCloud
from ..wire.tensors import JSON, PLY, Array
from ..wire.transport import about
from .normalise import REQUEST, Rule, normalise, with_std

T = TypeVar("T")


class RegisteredCloud:
    """The part of `Cloud` that describes, posts, posts again and deletes it."""

    def __init__(
        self,
        connection: Connection,
        description: models.Cloud,
        points: Array | None = None,
        normals: Array | None = None,
        file: bytes | None = None,
    ) -> None:
        """Takes the service's description of the cloud. `Client.cloud` and `Client.clouds` make clouds."""
        self._connection = connection
        self.description = description
        self._points = points
        self._normals = normals
        self._file = file

    def __repr__(self) -> str:
        return f"Cloud(id='{self.id[:8]}…', n_points={self.n_points}, dimension={self.dimension})"

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Cloud cannot be pickled, since it has connections; its points and its answers can")

    @property
    def id(self) -> str:
        """The id of the cloud, 64 hexadecimal digits."""
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
        """Points `[n, d]`, read-only. None if the cloud comes from a file or a list of clouds."""
        return self._points

    @property
    def normals_given(self) -> Array | None:
        """Normals `[n, d]` with which the cloud was made, read-only. Their side is outward."""
        return self._normals

    def delete(self) -> None:
        """Makes the service forget the points and everything computed from them.

        Does nothing if the service has already forgotten them.
        """
        try:
            self._connection.send("DELETE", f"/v1/clouds/{self.id}", headers=about(self.id))
        except UnknownCloud:
            return

    def _compute(self, read: Callable[..., T], path: str, rules: Mapping[str, Rule] = REQUEST, **fields: object) -> T:
        """Computes something about this cloud, and possibly the surface of another one.

        If the service has forgotten a cloud, both are posted again if their points or files are available.
        The request is then repeated once: the ids in it are still right.
        """
        sizes = {"n": self.n_points, "d": self.dimension}
        request = {"cloud": {"id": self.id}, **normalise(with_std(fields), rules, sizes)}
        # Without queries an operator answers at the points of its surface.
        at = _cloud_of(fields.get("surface")) or self
        placed = partial(read, positions=_read_only(request.get("queries", at._points)), points=self._points)
        try:
            return self._connection.compute(path, request, placed, self.id)
        except UnknownCloud:
            if not self._post_again(self, _cloud_of(fields.get("surface"))):
                raise
        return self._connection.compute(path, request, placed, self.id)

    def _post_again(self, *clouds: RegisteredCloud | None) -> bool:
        """Posts the clouds whose points or file are available. Returns true if there was one."""
        posted = [cloud._post(self.id) for cloud in clouds if cloud is not None]
        return any(posted)

    def _post(self, asked: str) -> bool:
        """Posts the points or the file, and returns true if there was either.

        Posts to the replica that gets requests about the cloud `asked`.
        """
        if self._points is not None:
            register(self._connection, self._points, self._normals, asked)
        elif self._file is not None:
            register_file(self._connection, self._file, asked)
        return self._points is not None or self._file is not None


def _cloud_of(surface: object) -> RegisteredCloud | None:
    """Returns the cloud of a surface in any form, or None if it has no cloud or only an id."""
    inner = surface.get("cloud") if isinstance(surface, Mapping) else getattr(surface, "cloud", None)
    return next((cloud for cloud in (surface, inner) if isinstance(cloud, RegisteredCloud)), None)


def register(connection: Connection, points: Array, normals: Array | None, cloud_id: str | None = None) -> models.Cloud:
    """Posts points, and returns the service's description of the cloud.

    Posts to the replica that has the cloud `cloud_id`, if given.
    """
    fields = {"points": points} if normals is None else {"points": points, "normals": normals}
    return connection.read(models.Cloud.from_dict, connection.post("/v1/clouds", fields, JSON, cloud_id))


def register_file(connection: Connection, file: bytes, cloud_id: str | None = None) -> models.Cloud:
    """Posts a PLY file, and returns the service's description of the cloud.

    Posts to the replica that has the cloud `cloud_id`, if given.
    """
    headers = {"Content-Type": PLY, "Accept": JSON, **about(cloud_id)}
    response = connection.send("POST", "/v1/clouds", content=file, headers=headers)
    return connection.read(models.Cloud.from_dict, response)


def _read_only(array: object) -> Array | None:
    """Returns a view of an array that cannot be written to, as all arrays of answers."""
    if not isinstance(array, np.ndarray):
        return None
    view = array.view()
    view.flags.writeable = False
    return view
