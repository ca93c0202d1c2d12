"""Displays of surfaces: points and meshes, coloured by a quantity."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from ..wire.tensors import Array, Integers
from .colours import colours_of, limits_of, mappable_of
from .needed import needed
from .splats import camera, shaded, splatted

WIDTH = 900
"""Pixels of the longer side of a picture of points in space."""


QUANTITIES = ("mean_curvatures", "residuals", "gradient_norms")
"""What is shown if nothing is named, the first that there is."""


class SurfaceDisplay:
    """Points of a surface, coloured by a quantity and grey where it is uncertain.

    Parameters
    ----------
    positions
        `[m, d]`, d = 2 or 3.
    values
        `[m]`. NaN where there is no answer: a ring marks these.
    std
        `[m]`. Standard deviations of the values.
    normals
        `[m, d]`. With them, points are shaded.
    name
        Title of the picture, such as `"mean curvatures"`.
    is_signed
        True for a range of colours that is symmetric about 0.
    """

    def __init__(
        self,
        positions: Array,
        values: Array,
        *,
        std: Array | None = None,
        normals: Array | None = None,
        name: str = "",
        is_signed: bool = False,
    ) -> None:
        self.positions = np.asarray(positions, dtype=np.float64)
        self.values = np.asarray(values, dtype=np.float64)
        self.std = std
        self.normals = normals
        self.name = name
        self.is_signed = is_signed

    @classmethod
    def from_answer(
        cls,
        answer: Any,  # noqa: ANN401 (Curvatures or Normals)
        quantity: str | None = None,
        positions: Array | None = None,
    ) -> Self:
        """Takes a quantity of curvatures or normals: the mean curvatures, or the first that there is.

        Raises
        ------
        ValueError
            If the positions are not known, because the client has no copy of the points, or if the answer lacks
            the quantity.
        """
        places = answer.positions if positions is None else positions
        if places is None:
            raise ValueError("the positions are not known: give them, as plot(positions=points)")
        name = quantity or default_quantity(answer)
        values = getattr(answer, name, None)
        if values is None:
            raise ValueError(f"the answer has no {name}")
        if values.ndim == 2:
            values = values[:, 0]
        return cls(
            places,
            values,
            std=std_of(answer, name),
            normals=answer.normals,
            name=name.replace("_", " "),
            is_signed=name.endswith("curvatures"),
        )

    def plot(
        self,
        ax: Any = None,  # noqa: ANN401 (Axes)
        *,
        elevation: float = 25.0,
        azimuth: float = -60.0,
        cmap: str | None = None,
        limits: tuple[float, float] | None = None,
        size: float | None = None,
        suppress: bool = True,
    ) -> Self:
        """Draws the points.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw. New axes if absent.
        elevation, azimuth : float, optional
            The direction from which space is seen, degrees.
        cmap : str, optional
            A scale of colours of matplotlib.
        limits : tuple, optional
            Values at the ends of the colours. Percentiles 2 and 98 if absent.
        size : float, optional
            Radius of the points, in the unit of the positions. By their spacing if absent.
        suppress : bool, optional
            False to show colours however uncertain they are.
        """
        axes = _axes(ax)
        self.mappable_ = mappable_of(
            limits or limits_of(self.values, is_signed=self.is_signed),
            cmap or ("RdYlBu_r" if self.is_signed else "viridis"),
        )
        colours = colours_of(self.mappable_, self.values, self.std if suppress else None)
        if self.positions.shape[1] == 2:
            self._draw_flat(axes, colours)
        else:
            view = camera(elevation, azimuth)
            self._draw_in_space(axes, view, shaded(colours, self.normals, view), size)
        _finish(axes, self.name, self.mappable_)
        self.axes_, self.figure_ = axes, axes.figure
        return self

    def _draw_flat(self, axes: Any, colours: Array) -> None:  # noqa: ANN401
        is_known = np.isfinite(self.values)
        axes.scatter(*self.positions[is_known].T, c=colours[is_known], s=14)
        axes.scatter(*self.positions[~is_known].T, facecolors="none", edgecolors="magenta", s=30)

    def _draw_in_space(self, axes: Any, view: Array, colours: Array, size: float | None) -> None:  # noqa: ANN401
        is_known = np.isfinite(self.values)
        places = self.positions @ view.T
        extent = float(np.ptp(places[:, :2], axis=0).max())
        radius = size or min(1.5 / np.sqrt(len(places)), 0.03) * (extent or 1.0)
        if is_known.any():
            image, box = splatted(places[is_known], colours[is_known], radius, WIDTH)
            axes.imshow(image, extent=box, origin="lower", interpolation="antialiased")
        axes.scatter(*places[~is_known, :2].T, facecolors="none", edgecolors="magenta", s=20, linewidths=0.6)


class LevelSetDisplay:
    """A mesh, coloured by a quantity of its vertices.

    Parameters
    ----------
    mesh
        A `gramian.Mesh`. Its triangles are drawn from back to front.
    values
        `[k]`. A quantity at the vertices.
    std
        `[k]`. Standard deviations of the values.
    name
        Title of the picture.
    """

    def __init__(
        self,
        mesh: Any,  # noqa: ANN401 (Mesh)
        values: Array,
        *,
        std: Array | None = None,
        name: str = "",
    ) -> None:
        self.mesh = mesh
        self.values = values
        self.std = std
        self.name = name

    @classmethod
    def from_answer(cls, answer: Any, quantity: str | None = None) -> Self:  # noqa: ANN401 (Mesh)
        """Takes a quantity of a mesh: the mean curvatures, or else the residuals."""
        name = quantity or default_quantity(answer)
        values = getattr(answer, name, None)
        if values is None:
            raise ValueError(f"the answer has no {name}")
        if values.ndim == 2:
            values = values[:, 0]
        return cls(answer, values, std=std_of(answer, name), name=name.replace("_", " "))

    def plot(
        self,
        ax: Any = None,  # noqa: ANN401 (Axes)
        *,
        elevation: float = 25.0,
        azimuth: float = -60.0,
        cmap: str | None = None,
        limits: tuple[float, float] | None = None,
    ) -> Self:
        """Draws the mesh. The looks are those of `SurfaceDisplay.plot`."""
        axes = _axes(ax)
        is_signed = self.name.endswith("curvatures")
        known = limits or limits_of(self.values, is_signed=is_signed)
        self.mappable_ = mappable_of(known, cmap or ("RdYlBu_r" if is_signed else "viridis"))
        colours = colours_of(self.mappable_, self.values, self.std)
        cells = self.mesh.cells
        if cells.shape[1] == 2:
            _draw_segments(axes, self.mesh.vertices[cells], colours[cells].mean(axis=1))
        else:
            view = camera(elevation, azimuth)
            colours = shaded(colours, self.mesh.normals, view)
            _draw_triangles(axes, (self.mesh.vertices @ view.T)[cells], colours[cells].mean(axis=1))
        axes.autoscale()
        _finish(axes, self.name, self.mappable_)
        self.axes_, self.figure_ = axes, axes.figure
        return self


def default_quantity(answer: object) -> str:
    """Returns the quantity that is shown if none is named."""
    return next(name for name in QUANTITIES if getattr(answer, name, None) is not None)


def std_of(answer: object, quantity: str) -> Array | None:
    """Returns the standard deviations of a quantity, if the answer has them."""
    found: Array | None = getattr(answer, f"{quantity.removesuffix('s')}_std", None)
    return found if found is None or found.ndim == 1 else found[:, 0]


def to_pyvista(positions: Array, cells: Integers | None, attributes: dict[str, Array]) -> Any:  # noqa: ANN401 (PolyData)
    """Returns points or triangles of pyvista, with attributes of the points.

    Raises
    ------
    ModuleNotFoundError
        If pyvista is not installed.
    """
    pyvista = needed("pyvista", "pyvista")
    positions = np.asarray(positions, dtype=np.float64)
    places = np.column_stack([positions, np.zeros((len(positions), 3 - positions.shape[1]))])
    made = pyvista.PolyData(places)
    if cells is not None:
        padded = np.column_stack([np.full(len(cells), cells.shape[1]), cells]).ravel()
        made = pyvista.PolyData(places, padded) if cells.shape[1] == 3 else pyvista.PolyData(places, lines=padded)
    for name, array in attributes.items():
        made.point_data[name] = array
    return made


def shown_by_pyvista(data: Any, quantity: str | None) -> Any:  # noqa: ANN401 (PolyData, Plotter)
    """Returns a plotter of pyvista with the points or triangles, coloured by a quantity."""
    if quantity is not None and quantity not in data.point_data:
        raise ValueError(f"the answer has no {quantity}")
    plotter = needed("pyvista", "pyvista").Plotter()
    names = [quantity] if quantity else [*QUANTITIES, *data.point_data.keys()]
    scalars = next(name for name in names if name in data.point_data)
    plotter.add_mesh(data, scalars=scalars, render_points_as_spheres=True, point_size=8)
    return plotter


def _axes(ax: Any) -> Any:  # noqa: ANN401
    return needed("matplotlib.pyplot", "plot").subplots()[1] if ax is None else ax


def _finish(axes: Any, name: str, mappable: Any) -> None:  # noqa: ANN401
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(name)
    axes.figure.colorbar(mappable, ax=axes, shrink=0.7, extend="both")


def _draw_segments(axes: Any, ends: Array, colours: Array) -> None:  # noqa: ANN401
    axes.add_collection(needed("matplotlib.collections", "plot").LineCollection(ends, colors=colours))


def _draw_triangles(axes: Any, corners: Array, colours: Array) -> None:  # noqa: ANN401
    """Draws triangles `[l, 3, 3]` from back to front."""
    order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")
    polygons = needed("matplotlib.collections", "plot").PolyCollection(
        corners[order, :, :2], facecolors=colours[order], edgecolors=colours[order], linewidths=0.3, rasterized=True
    )
    axes.add_collection(polygons)
