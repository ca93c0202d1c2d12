"""Displays of surfaces: points and meshes, coloured by a quantity."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from ..wire.tensors import Array
from .axes import axes_of, draw_directions, labelled, name_plane
from .colours import colours_of, limits_of, mappable_of
from .needed import needed
from .quantities import default_quantity, is_signed, scalars_of, std_of
from .splats import camera, shaded, splatted

WIDTH = 900
"""Pixels of the longer side of a picture of points in space."""


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
    units
        Units of the positions and of the values.
    data
        Positions `[n, 2]` and values `[n]` of the data, which are drawn in the plane.
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
        units: tuple[str, str] = ("L", ""),
        data: tuple[Array, Array] | None = None,
    ) -> None:
        self.positions = np.asarray(positions, dtype=np.float64)
        self.values = np.asarray(values, dtype=np.float64)
        self.std = std
        self.normals = normals
        self.name = name
        self.is_signed = is_signed
        self.units = units
        self.data = data

    @classmethod
    def from_answer(
        cls,
        answer: Any,  # noqa: ANN401 (an Answer)
        quantity: str | None = None,
        positions: Array | None = None,
        units: tuple[str, str] = ("L", "V"),
    ) -> Self:
        """Takes a quantity of an answer with a number for each position: the mean curvatures, or the first there is.

        Raises
        ------
        AttributeError
            If the quantity was not asked for.
        ValueError
            If the positions are not known, because the client has no copy of the points, or if the answer lacks
            the quantity.
        """
        places = answer.positions if positions is None else positions
        if places is None:
            raise ValueError("the positions are not known: give them, as plot(positions=points)")
        name = quantity or default_quantity(answer) or ""
        given = getattr(answer, "data", None) if name in ("values", "means") else None
        return cls(
            places,
            scalars_of(answer, name),
            std=std_of(answer, name),
            normals=getattr(answer, "normals", None),
            name=name.replace("_", " "),
            is_signed=is_signed(name),
            units=(units[0], answer.unit(name, *units)),
            data=None if given is None or given.values.ndim > 1 else (given.points, given.values),
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
        axes = axes_of(ax)
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
        _finish(axes, self.name, self.mappable_, _bar(self.units[1], self.std if suppress else None))
        self.axes_, self.figure_ = axes, axes.figure
        return self

    def _draw_flat(self, axes: Any, colours: Array) -> None:  # noqa: ANN401
        is_known = np.isfinite(self.values)
        axes.scatter(*self.positions[is_known].T, c=colours[is_known], s=14)
        axes.scatter(*self.positions[~is_known].T, facecolors="none", edgecolors="magenta", s=30)
        if self.data is not None:
            places, values = self.data
            colours = self.mappable_.to_rgba(values)
            axes.scatter(*places.T, c=colours, s=14, edgecolors="black", linewidths=0.6, label="data")
        name_plane(axes, self.units[0])

    def _draw_in_space(self, axes: Any, view: Array, colours: Array, size: float | None) -> None:  # noqa: ANN401
        is_known = np.isfinite(self.values)
        places = self.positions @ view.T
        extent = float(np.ptp(places[:, :2], axis=0).max())
        radius = size or min(1.5 / np.sqrt(len(places)), 0.03) * (extent or 1.0)
        if is_known.any():
            image, box = splatted(places[is_known], colours[is_known], radius, WIDTH)
            axes.imshow(image, extent=box, origin="lower", interpolation="antialiased")
        axes.scatter(*places[~is_known, :2].T, facecolors="none", edgecolors="magenta", s=20, linewidths=0.6)
        low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
        draw_directions(axes, view, (low[0], high[0], low[1], high[1]), self.units[0])
        axes.set_axis_off()


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
    units
        Units of the vertices and of the values.
    """

    def __init__(
        self,
        mesh: Any,  # noqa: ANN401 (Mesh)
        values: Array,
        *,
        std: Array | None = None,
        name: str = "",
        units: tuple[str, str] = ("L", ""),
    ) -> None:
        self.mesh = mesh
        self.values = values
        self.std = std
        self.name = name
        self.units = units

    @classmethod
    def from_answer(
        cls,
        answer: Any,  # noqa: ANN401 (Mesh)
        quantity: str | None = None,
        units: tuple[str, str] = ("L", "V"),
    ) -> Self:
        """Takes a quantity of a mesh: the mean curvatures, or else the residuals."""
        name = quantity or default_quantity(answer) or ""
        return cls(
            answer,
            scalars_of(answer, name),
            std=std_of(answer, name),
            name=name.replace("_", " "),
            units=(units[0], answer.unit(name, *units)),
        )

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
        axes = axes_of(ax)
        signed = is_signed(self.name)
        known = limits or limits_of(self.values, is_signed=signed)
        self.mappable_ = mappable_of(known, cmap or ("RdYlBu_r" if signed else "viridis"))
        colours = colours_of(self.mappable_, self.values, self.std)
        cells = self.mesh.cells
        if cells.shape[1] == 2:
            _draw_segments(axes, self.mesh.vertices[cells], colours[cells].mean(axis=1))
            axes.autoscale()
            name_plane(axes, self.units[0])
        else:
            view = camera(elevation, azimuth)
            colours, places = shaded(colours, self.mesh.normals, view), self.mesh.vertices @ view.T
            _draw_triangles(axes, places[cells], colours[cells].mean(axis=1))
            axes.autoscale()
            draw_directions(axes, view, (*axes.get_xlim(), *axes.get_ylim()), self.units[0])
            axes.set_axis_off()
        _finish(axes, self.name, self.mappable_, _bar(self.units[1], self.std))
        self.axes_, self.figure_ = axes, axes.figure
        return self


def shown_by_pyvista(data: Any, quantity: str, unit: str) -> Any:  # noqa: ANN401 (PolyData, Plotter)
    """Returns a plotter of pyvista with the points or triangles, coloured by a quantity."""
    plotter = needed("pyvista", "pyvista").Plotter()
    bar = {"title": labelled(quantity.replace("_", " "), unit)}
    plotter.add_mesh(data, scalars=quantity, render_points_as_spheres=True, point_size=8, scalar_bar_args=bar)
    plotter.add_axes()
    return plotter


def _bar(unit: str, std: Array | None) -> str:
    """Returns the label of the bar of colours."""
    return f"{unit} (grey where uncertain)".strip() if std is not None else unit


def _finish(axes: Any, name: str, mappable: Any, label: str) -> None:  # noqa: ANN401
    axes.set_aspect("equal")
    axes.set_title(name)
    axes.figure.colorbar(mappable, ax=axes, shrink=0.7, extend="both", label=label)


def _draw_segments(axes: Any, ends: Array, colours: Array) -> None:  # noqa: ANN401
    axes.add_collection(needed("matplotlib.collections", "plot").LineCollection(ends, colors=colours))


def _draw_triangles(axes: Any, corners: Array, colours: Array) -> None:  # noqa: ANN401
    """Draws triangles `[l, 3, 3]` from back to front."""
    order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")
    polygons = needed("matplotlib.collections", "plot").PolyCollection(
        corners[order, :, :2], facecolors=colours[order], edgecolors=colours[order], linewidths=0.3, rasterized=True
    )
    axes.add_collection(polygons)
