"""Clouds in tiles, and what can be asked about them."""

from __future__ import annotations

import dask
import dask.array as da
import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix

from ..arguments.blocks import aligned, rows_of
from ..arguments.fit import KernelLike, Mean, Number, ValuesFit
from ..arguments.keywords import suggest_names
from ..rest.models import Hyperparameters
from ..tiles.replicas import Replicas
from . import answers, requests
from .cells import graph
from .cells.plan import Plan
from .kriging import Kriging, Law
from .surface import SurfaceTiles


@suggest_names
class Tiles:
    """A cloud of any size, cut into tiles that replicas answer one by one.

    Methods return Dask arrays; the work is done when Dask computes them, with its progress, its retries
    (`dask.compute(answer, retries=3)`) and its dashboard. Ask for several things in one `dask.compute`, and each tile
    is cut once.

    Answers are those of one request for all points with `solver="local"` and the `hyperparameters` of the tiles, up to
    ties of distance and the sides of single points. Where there is so much noise that the service regresses on means
    of points, tiles have other means than the cloud. Answers then differ as those of two samples do.
    """

    def __init__(self, replicas: Replicas, points: da.Array, n_tiles: int) -> None:
        """Looks at the points, in blocks of rows; `Service.tiles` makes tiles."""
        self._replicas = replicas
        self._points = points
        self._surface: SurfaceTiles | None = None
        self.plan = Plan.of(self._points, n_tiles)

    def __repr__(self) -> str:
        n, d = self._points.shape
        return f"Tiles(n_points={n}, dimension={d}, n_tiles={self.n_tiles})"

    @property
    def n_tiles(self) -> int:
        """The number of tiles."""
        return self.plan.cut.n_cells

    @property
    def hyperparameters(self) -> Hyperparameters:
        """What local regressions of all tiles take as learned. They are learned now, if they are not yet."""
        return self._in_tiles().whole.hyperparameters

    def cells(self) -> da.Array:
        """Says in which tile each point is, `[n]`, from 0."""
        return self._points.map_blocks(self.plan.cut.cells_of, drop_axis=1, dtype=np.int64)

    def normals(self, *, std: bool = False) -> answers.Normals:
        """Computes unit normals at the points, outward as the coarse cloud has it, with `std` if asked for."""
        return answers.named(answers.Normals, self._of_surface("normals", std))

    def curvatures(self, *, std: bool = False) -> answers.Curvatures:
        """Computes curvatures at the points, with `std` if asked for; a sphere of radius r has +1/r."""
        return answers.named(answers.Curvatures, self._of_surface("curvatures", std))

    def laplace_beltrami(self) -> answers.SparseOperator:
        """Assembles the sparse Laplace–Beltrami operator on values at the points, 1/L²."""
        return self._operator("laplace_beltrami", 1)

    def surface_gradient(self) -> answers.SparseOperator:
        """Assembles the d components of the sparse surface gradient of values at the points, 1/L."""
        return self._operator("surface_gradient", self.plan.dimension)

    def interpolate(
        self,
        values: npt.ArrayLike | da.Array,
        queries: npt.ArrayLike | da.Array | None = None,
        *,
        derivatives: int = 0,
        std: bool = False,
        kernel: KernelLike | None = None,
        alpha: Number | None = None,
        mean: Mean | None = None,
    ) -> answers.Interpolation:
        """Kriges values at queries, each from the 128 points nearest to it.

        Kernel, noise and mean are one for all tiles. What is not given (a length scale, `alpha`, the coefficients of a
        mean) is learned here and now, from up to 256 values, where the service would look at all.

        Parameters are those of `gramian.Cloud.interpolate`. Values and queries may be Dask arrays.
        """
        own = aligned(values, self._points)
        fit = ValuesFit(solver="dense", kernel=kernel, alpha=alpha, mean=mean)
        law = Law.of(self._replicas, self.plan, (self._points, own), fit)
        cores = graph.cores(self._points, self.plan, own)
        asked = self._points if queries is None else rows_of(queries, "queries", self.plan.dimension)
        wanted = cores if queries is None else graph.cores(asked, self.plan)
        rims = graph.rims(cores, self.plan, law.reach, wanted)
        kriging, krige = Kriging(law, derivatives, std), dask.delayed(Kriging.krige, pure=True)
        asks = [
            krige(kriging, self._replicas, cell, cores[cell], rims[cell], wanted[cell]) for cell in range(self.n_tiles)
        ]
        found = graph.gathered(asks, asked.chunks[0], kriging.kinds(self.plan.dimension))
        return answers.named(answers.Interpolation, found)

    def _of_surface(self, what: str, std: bool) -> dict[str, da.Array]:
        surface, ask = self._in_tiles(), dask.delayed(requests.surface, pure=True)
        pairs = zip(surface.tiles, surface.sides, strict=True)
        rows = [ask(self._replicas, tile, sides, surface.whole, what, std) for tile, sides in pairs]
        d = self.plan.dimension
        shapes: dict[str, tuple[int, ...]] = {"normals": (d,), "levels": ()}
        known: dict[str, tuple[int, ...]] = {"normal": ()}
        if what == "curvatures":
            known |= {"principal_curvature": (d - 1,), "mean_curvature": (), "gaussian_curvature": ()}
            shapes |= {f"{name}s": shape for name, shape in known.items()}
            shapes |= {"principal_directions": (d - 1, d), "normals": (d,)}
        if std:
            shapes |= {f"{name}_std": shape for name, shape in known.items()}
        kinds = {name: np.empty((0, *shape)) for name, shape in shapes.items()}
        return graph.gathered(rows, self._points.chunks[0], {**kinds, "reasons": requests.NO_REASONS})

    def _operator(self, what: str, n_components: int) -> answers.SparseOperator:
        n = self.plan.n_points
        names = [f"matrix {component}" for component in range(n_components)]
        kinds = {"reasons": requests.NO_REASONS, **{name: csr_matrix((0, n)) for name in names}}
        surface, ask = self._in_tiles(), dask.delayed(requests.operator, pure=True)
        rows = [ask(self._replicas, tile, surface.whole, what, n) for tile in surface.tiles]
        found = graph.gathered(rows, self._points.chunks[0], kinds)
        return answers.SparseOperator(tuple(found[name] for name in names), found["reasons"])

    def _in_tiles(self) -> SurfaceTiles:
        if self._surface is None:
            self._surface = SurfaceTiles.of(self._replicas, self._points, self.plan)
        return self._surface
