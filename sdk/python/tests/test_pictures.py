"""Meshes, pictures of answers, and services of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import trimesh

import gramian
from gramian.plot import LevelSetDisplay, LikelihoodDisplay, PosteriorDisplay, SurfaceDisplay
from gramian.plot.splats import camera, splatted

mpl.use("Agg")

GOLDEN = np.pi * (3 - np.sqrt(5))


def sphere(n: int) -> Any:
    """Returns points spread over the unit sphere."""
    z = 1 - (2 * np.arange(n) + 1) / n
    across, angle = np.sqrt(1 - z * z), GOLDEN * np.arange(n)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), z])


@pytest.fixture(scope="module")
def cloud() -> Any:
    return gramian.Client().cloud(sphere(400))


@pytest.fixture(scope="module")
def mesh(cloud: Any) -> gramian.Mesh:
    found: gramian.Mesh = cloud.level_set(include="curvatures", std=True)
    return found


def test_a_mesh_is_closed_and_knows_its_errors(mesh: gramian.Mesh) -> None:
    (part,) = mesh.parts
    assert (part.euler_characteristic, part.n_boundary_edges, mesh.dropped_parts) == (2, 0, ())
    assert mesh.cells.shape == (part.n_cells, 3)
    assert mesh.cells.dtype == np.int64
    assert set(mesh.support) == {"observed"}
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() < 0.01
    for array in (mesh.mean_curvatures, mesh.position_std, mesh.normal_std):
        assert array.shape == (part.n_vertices,)


@pytest.mark.parametrize("ending", ["ply", "glb", "obj"])
def test_a_mesh_is_saved_and_read_by_trimesh(mesh: gramian.Mesh, tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"sphere.{ending}"
    mesh.save(path)
    found = trimesh.load(path, force="mesh", process=False)
    assert found.faces.shape == mesh.cells.shape
    assert found.is_watertight
    assert found.volume == pytest.approx(4 / 3 * np.pi, rel=0.05)


def test_what_cannot_be_saved_is_refused_by_name(mesh: gramian.Mesh) -> None:
    with pytest.raises(ValueError, match=r"\.ply, \.vtp, \.csv, \.npz, \.glb, \.obj or \.stl, not as"):
        mesh.save("mesh.docx")
    angles = np.arange(30) * np.pi / 15
    polyline = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)])).level_set()
    with pytest.raises(ValueError, match="segments"):
        polyline.to_trimesh()
    with pytest.raises(ValueError, match="segments"):
        polyline.save("mesh.glb")


def test_a_level_of_values_is_a_mesh() -> None:
    points = np.stack(np.meshgrid(*[np.linspace(-1, 1, 12)] * 2), axis=-1).reshape(-1, 2)
    square = gramian.Client().cloud(points)
    found = square.level_set((points**2).sum(axis=1), 0.25, kernel="gauss")
    assert np.abs(np.linalg.norm(found.vertices, axis=1) - 0.5).max() < 0.01
    assert found.closedness is None
    assert isinstance(found.plot(), LevelSetDisplay)


def test_answers_draw_themselves(cloud: Any, mesh: gramian.Mesh) -> None:
    curvatures = cloud.curvatures(std=True)
    assert np.shares_memory(curvatures.positions, cloud.points)
    display = curvatures.plot()
    assert isinstance(display, SurfaceDisplay)
    assert display.figure_ is display.axes_.figure
    assert (display.mappable_.norm.vmin, display.axes_.get_title()) == (-display.mappable_.norm.vmax, "mean curvatures")
    assert mesh.plot("position_std").axes_.get_title() == "position std"
    assert cloud.normals([[1.0, 0, 0], [0, 1.0, 0]]).plot().positions.shape == (2, 3)
    with pytest.raises(ValueError, match="no such_thing"):
        curvatures.plot("such_thing")


def test_posteriors_and_likelihoods_are_lines() -> None:
    x = np.linspace(0, 6, 20)
    line = gramian.Client().cloud(x[:, None])
    values = np.sin(x)
    posterior = line.posterior(values, [[1.0], [2.0]], include="variances", kernel="gauss", alpha=1e-4).plot()
    assert isinstance(posterior, PosteriorDisplay)
    assert posterior.places.tolist() == [1.0, 2.0]
    assert isinstance(line.select_model(values, families="gauss").plot(), LikelihoodDisplay)


def test_pictures_of_a_line_have_data_units_and_a_band() -> None:
    x = np.linspace(0, 6, 20)
    values = np.sin(x)
    line = gramian.Client().cloud(x[:, None])
    at = np.linspace(0, 6, 50)[:, None]
    posterior = line.posterior(values, at, include="variances", samples=3, kernel="gauss", alpha=1e-4)
    axes = posterior.plot(length_unit="mm", value_unit="K").axes_
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x, mm", "means, K")
    drawn = {each.get_label(): each for each in axes.lines}
    np.testing.assert_array_equal(drawn["data"].get_xydata(), np.column_stack([x, values]))
    assert len(axes.lines) == 5  # the mean, the data and three samples
    assert "95 %" in [text.get_text() for text in axes.get_legend().get_texts()]
    slope = line.interpolate(values, at, derivatives=1, kernel="gauss").plot("gradients", value_unit="K").axes_
    assert slope.get_ylabel() == "gradients, K/L"
    batch = line.interpolate_batch([values, -values], at, kernel="gauss").plot().axes_
    assert [len(each.get_xdata()) for each in batch.lines] == [50, 20, 50, 20]


def test_pictures_of_the_plane_have_the_data_and_names_of_axes() -> None:
    points = np.random.default_rng(0).uniform(size=(40, 2))
    square = gramian.Client().cloud(points)
    posterior = square.posterior(points[:, 0], points[:9] + 0.01, include="variances", kernel="gauss", alpha=1e-4)
    display = posterior.plot(length_unit="mm", value_unit="K")
    assert (display.axes_.get_xlabel(), display.axes_.get_ylabel()) == ("x, mm", "y, mm")
    assert display.figure_.axes[1].get_ylabel() == "K (grey where uncertain)"
    np.testing.assert_array_equal(display.axes_.collections[-1].get_offsets(), points)
    along = posterior.plot(places=np.arange(9.0)).axes_
    assert along.get_xlabel() == "way along the queries, L"


def test_pictures_of_space_have_directions_and_a_length(cloud: Any, mesh: gramian.Mesh) -> None:
    for answer in (cloud.curvatures(), mesh, cloud.laplace_beltrami(cloud.points[:, 2])):
        axes = answer.plot(length_unit="mm").axes_
        assert [text.get_text() for text in axes.texts] == ["x", "y", "z", "0.2 mm"]
    assert mesh.plot("principal_curvatures", length_unit="mm").figure_.axes[1].get_ylabel().startswith("1/mm")


def test_a_likelihood_is_shown_where_it_matters() -> None:
    x = np.linspace(0, 6, 40)
    values = np.sin(x) + 0.1 * np.random.default_rng(0).normal(size=40)
    found = gramian.Client().cloud(x[:, None]).select_model(values, kernel="gauss", alpha=0.01, restarts=0)
    axes = found.plot(value_unit="K").axes_
    assert axes.get_xlabel() == "α, variance of the noise, K²"
    assert axes.get_ylabel() == "log marginal likelihood"
    low, high = axes.get_ylim()
    assert high - low < 35
    assert low < found.score < high
    left, right = axes.get_xlim()
    assert left < found.alpha < right
    assert found.criterion is gramian.SelectionCriterion.MARGINAL_LIKELIHOOD
    assert found.leave_one_out.plot().axes_.get_ylabel() == "means, V"
    assert found.alpha_path.plot().axes_.get_ylabel() == "score"


def test_positions_that_are_not_known_are_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "sphere.ply"
    head = (
        "ply\nformat ascii 1.0\nelement vertex 100\nproperty double x\nproperty double y\nproperty double z\nend_header"
    )
    np.savetxt(path, sphere(100), header=head, comments="")
    normals = gramian.Client().cloud(path).normals()
    with pytest.raises(ValueError, match="positions=points"):
        normals.plot()
    assert normals.plot(positions=sphere(100)).positions.shape == (100, 3)


def test_a_notebook_shows_a_table_and_a_histogram(cloud: Any) -> None:
    page = cloud.curvatures()._repr_html_()
    assert page.startswith("<b>Curvatures</b><table>")
    assert "mean_curvatures" in page
    assert "<svg" in page


def test_the_nearer_disc_hides_the_other() -> None:
    places = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [3.0, 0.0, 0.0]])
    image, extent = splatted(places, np.eye(3), 0.5, 80)
    middle = image.shape[0] // 2
    assert image[middle, 10, :3].tolist() == [0, 1, 0]
    assert image[middle, 70, :3].tolist() == [0, 0, 1]
    assert image[middle, 40, 3] == 0
    assert extent[0] == -0.5
    assert np.allclose(camera(20, 50) @ camera(20, 50).T, np.eye(3))
