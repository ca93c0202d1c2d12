"""Operations on the surface that the points of a cloud sample."""

from __future__ import annotations

from typing import Unpack

import numpy.typing as npt

from ..answers import Curvatures, Mesh, Normals
from ..arguments.fit import Number
from ..arguments.keywords import suggest_names
from ..arguments.normalise import GEOMETRIC, MESH
from ..arguments.options import MeshOptions, SurfaceOptions
from ..arguments.registration import RegisteredCloud


@suggest_names
class SurfaceOfCloud(RegisteredCloud):
    """The part of `Cloud` that concerns the surface that its points sample."""

    def normals(
        self,
        queries: npt.ArrayLike | None = None,
        *,
        sites: npt.ArrayLike | None = None,
        **options: Unpack[SurfaceOptions],
    ) -> Normals:
        """Computes unit normals ν = −∇u/|∇u| of the surface that the points sample. No mesh is needed.

        `gramian.SurfaceOptions` describes further options.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions at which to compute normals, a row of coordinates each. The points if absent.
        sites : array_like, `[s, d]`, optional
            Positions at which the local solver learns noise and shape of the surface, at most 192 points of
            the cloud. The solver chooses some if absent.

        Returns
        -------
        Normals
            `normals` at the queries, NaN where there is none, and `flags` says why. `normal_std`
            if requested.

        Examples
        --------
        >>> angles = np.arange(8) * np.pi / 4
        >>> circle = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> answer = circle.normals([[0.8, 0.6], [0, 0]], kernel={"family": "gauss", "length_scale": 2})
        >>> answer.normals.round(3)
        array([[0.8, 0.6],
               [nan, nan]])
        >>> [(entry.query, entry.reason.value) for entry in answer.flags]
        [(1, 'vanishing_gradient')]
        """
        return self._compute(Normals.read, "/v1/normals", GEOMETRIC, queries=queries, sites=sites, **options)

    def curvatures(self, queries: npt.ArrayLike | None = None, **options: Unpack[SurfaceOptions]) -> Curvatures:
        """Computes principal, mean and Gaussian curvatures of the surface that the points sample.

        No mesh is needed. With outward normals a sphere of radius r has the curvatures +1/r.
        `gramian.SurfaceOptions` describes the options.

        Parameters
        ----------
        queries : array_like, `[m, d]`, optional
            Positions at which to compute curvatures, a row of coordinates each. The points if absent.

        Returns
        -------
        Curvatures
            `principal_curvatures`, `mean_curvatures`, `gaussian_curvatures` and more at the queries, NaN
            where there are none, and `flags` says why. Standard deviations of each if requested.

        Examples
        --------
        >>> angles = np.arange(64) * np.pi / 32
        >>> circle = gramian.Client().cloud(5 * np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> circle.curvatures([[5, 0], [0, 5]]).principal_curvatures.round(2)
        array([[0.2],
               [0.2]])

        With standard deviations, for noise of 0.01 in the points:

        >>> noise = 0.01 * np.random.default_rng(0).normal(size=(64, 1))
        >>> noisy = gramian.Client().cloud((5 + noise) * np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> answer = noisy.curvatures([[5, 0]], std=True)
        >>> answer.mean_curvatures.round(3), answer.mean_curvature_std.round(3)
        (array([0.202]), array([0.004]))
        """
        return self._compute(Curvatures.read, "/v1/curvatures", GEOMETRIC, queries=queries, **options)

    def level_set(
        self, values: npt.ArrayLike | None = None, level: Number | None = None, **options: Unpack[MeshOptions]
    ) -> Mesh:
        """Meshes the surface that the points sample, or a level of the function through values.

        The mesh is a manifold, and closed wherever `bounds` does not cut it. `gramian.MeshOptions` describes the
        options.

        Parameters
        ----------
        values : array_like, `[n]`, optional
            A number for each point, V. A level of the function through them is meshed instead of the surface.
        level : float, optional
            The level of that function, V. The median of the values if absent.

        Returns
        -------
        Mesh
            `vertices`, `cells`, `normals` and the `support` of each vertex. Curvatures and standard
            deviations if requested.

        Examples
        --------
        >>> angles = np.arange(64) * np.pi / 32
        >>> circle = gramian.Client().cloud(5 * np.column_stack([np.cos(angles), np.sin(angles)]))
        >>> mesh = circle.level_set(include="curvatures")
        >>> (part,) = mesh.parts
        >>> part.euler_characteristic, round(part.area, 1), mesh.mean_curvatures.mean().round(2)
        (0, 31.4, np.float64(0.2))
        """
        # The rules do not let values be absent where they are named.
        given = {} if values is None else {"values": values}
        return self._compute(Mesh.read, "/v1/level-set", MESH, level=level, **given, **options)
