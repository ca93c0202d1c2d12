"""Answers as summaries, tables and files: all numbers come out, also those in doubt."""

from __future__ import annotations

import csv
import inspect
import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
import scipy.sparse
import trimesh
from sent import CIRCLE, METHODS, VALUES

import gramian
from gramian import answers
from gramian.export import quantities_of
from gramian.export.colours import SCALES, colours_of
from gramian.export.quantities import ENTRY, UNIT

GOLDEN = np.pi * (3 - np.sqrt(5))
KINDS = [getattr(answers, name) for name in answers.__all__ if name not in ("Answer", "Data")]


@pytest.fixture(scope="module")
def cloud() -> Any:
    z = 1 - (2 * np.arange(300) + 1) / 300
    across, angle = np.sqrt(1 - z * z), GOLDEN * np.arange(300)
    return gramian.Client().cloud(np.column_stack([across * np.cos(angle), across * np.sin(angle), z]))


@pytest.fixture(scope="module")
def curvatures(cloud: Any) -> gramian.Curvatures:
    """Curvatures at twenty points, and far from all, where there are none."""
    found: gramian.Curvatures = cloud.curvatures(np.vstack([cloud.points[:20], np.full(3, 99.0)]), std=True)
    assert found.flags
    return found


def test_every_array_of_an_answer_documents_its_shape_and_unit() -> None:
    for kind in KINDS:
        hints = inspect.get_annotations(kind)
        arrays = [name for name, hint in hints.items() if hint in ("Array", "Array | None", "Integers")]
        known = quantities_of(kind)
        assert set(arrays) <= set(known), kind
    for kind in KINDS:
        for name, _, unit in ENTRY.findall(inspect.cleandoc(kind.__doc__ or "")):
            assert UNIT.fullmatch(unit) or not unit or " " in unit or name in ("cells", "support"), (kind, name, unit)
    assert quantities_of(gramian.PosteriorBatch)["samples"].axes == ("k", "count", "m")
    assert quantities_of(gramian.Curvatures)["gaussian_curvatures"].unit == "1/L^(d − 1)"


def test_a_print_is_a_few_lines(curvatures: gramian.Curvatures) -> None:
    lines = str(curvatures).splitlines()
    assert lines[0] == "Curvatures at 21 positions, from 300 points in 3 dimensions"
    assert lines[1].startswith("mean_curvatures: 1, 1, 1 1/L (2 %, median, 98 %), 1 NaN, median std ")
    assert lines[2].startswith("gaussian_curvatures: 1, 1, 1 1/L² (2 %, median, 98 %)")
    reason = curvatures.flags[0].reason.value
    assert lines[3] == f"flags: 1 {reason}"
    assert lines[4].startswith("solver: local, kernel ")
    assert lines[5:] == ["warnings: none"]


@pytest.mark.parametrize("method", METHODS)
def test_every_answer_prints_and_draws_itself(method: str) -> None:
    mpl.use("Agg")
    answer = getattr(gramian.Client().cloud(CIRCLE), method)(**METHODS[method])
    text = str(answer)
    assert 3 <= len(text.splitlines()) <= 8
    assert "from 8 points in 2 dimensions" in text
    assert "Unset" not in text
    display = answer.plot()
    assert display.figure_ is display.axes_.figure
    assert display.axes_.get_xlabel()
    assert display.axes_.get_ylabel()
    mpl.pyplot.close("all")


def test_a_selection_prints_its_model(cloud: Any) -> None:
    values = cloud.points[:, 2] + 0.1 * np.random.default_rng(0).normal(size=300)
    found = cloud.select_model(values, families=["gauss", "matern"], restarts=0)
    lines = str(found).splitlines()
    assert lines[1].startswith(f"kernel: {found.kernel.family.value}")
    assert lines[2] == f"noise: {found.alpha**0.5:.3g} V, that is alpha {found.alpha:.3g} V²"
    assert lines[3].startswith(f"marginal likelihood: {found.score:.6g}, ")
    assert lines[4].startswith("families: gauss ")
    assert lines[5].startswith("errors of predictions without the point: ")
    assert list(found.to_pandas().columns) == ["x", "y", "z", "mean", "variance", "log_predictive_density", "flags"]


def test_members_that_were_not_asked_for_say_how_to_ask(cloud: Any) -> None:
    plain = cloud.curvatures(cloud.points[:3])
    with pytest.raises(AttributeError, match=r"^this answer has no mean_curvature_std: std=True in the call asks for"):
        _ = plain.mean_curvature_std
    with pytest.raises(AttributeError, match='include="variances" in the call'):
        cloud.posterior(cloud.points[:, 0], cloud.points[:3]).plot("variances")
    assert "mean_curvature_std" not in repr(plain)


def test_a_table_has_all_numbers(curvatures: gramian.Curvatures) -> None:
    frame = curvatures.to_pandas()
    assert isinstance(frame, pd.DataFrame)
    assert len(frame) == 21
    np.testing.assert_array_equal(frame[["x", "y", "z"]], curvatures.positions)
    np.testing.assert_array_equal(frame[["nx", "ny", "nz"]], curvatures.normals)
    np.testing.assert_array_equal(frame["principal_curvature_1"], curvatures.principal_curvatures[:, 1])
    np.testing.assert_array_equal(frame["principal_direction_1_2"], curvatures.principal_directions[:, 1, 2])
    np.testing.assert_array_equal(frame["mean_curvature_std"], curvatures.mean_curvature_std)
    assert frame["flags"].tolist() == [""] * 20 + [curvatures.flags[0].reason.value]
    assert set(frame["surface_model"]) == {model.value for model in curvatures.surface_models}


def test_a_csv_file_reads_back_unchanged(curvatures: gramian.Curvatures, tmp_path: Path) -> None:
    curvatures.save(tmp_path / "out.csv")
    with (tmp_path / "out.csv").open() as file:
        rows = list(csv.DictReader(file))
    found = np.array([float(row["gaussian_curvature"]) for row in rows])
    np.testing.assert_array_equal(found, curvatures.gaussian_curvatures)
    read = pd.read_csv(tmp_path / "out.csv")
    pd.testing.assert_frame_equal(read.fillna({"flags": ""}), curvatures.to_pandas(), check_dtype=False)


def test_lists_of_values_are_columns(cloud: Any) -> None:
    batch = cloud.interpolate_batch(cloud.points.T, cloud.points[:5], derivatives=1)
    frame = batch.to_pandas()
    np.testing.assert_array_equal(frame[["value_0", "value_1", "value_2"]], batch.values.T)
    np.testing.assert_array_equal(frame["gradient_2_0"], batch.gradients[2, :, 0])


def properties(path: Path) -> tuple[list[str], Any]:
    """Returns the header of a PLY file and its vertices."""
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = head.decode().splitlines()
    at = next(at for at, line in enumerate(lines) if line.startswith("element vertex"))
    types = {"double": "<f8", "uchar": "u1"}
    kinds = []
    for line in lines[at + 1 :]:
        if not line.startswith("property") or "list" in line:
            break
        _, kind, name = line.split()
        kinds.append((name, types[kind]))
    return lines, np.frombuffer(body, dtype=kinds, count=int(lines[at].split()[2]))


def test_a_ply_file_has_quality_colours_and_flags(curvatures: gramian.Curvatures, tmp_path: Path) -> None:
    path = tmp_path / "out.ply"
    curvatures.save(path, quantity="gaussian_curvatures")
    lines, vertices = properties(path)
    assert "comment quality and colours: gaussian_curvatures" in lines
    np.testing.assert_array_equal(vertices["quality"], curvatures.gaussian_curvatures)
    np.testing.assert_array_equal(vertices["mean_curvature"], curvatures.mean_curvatures)
    reason = f"flag_{curvatures.flags[0].reason.value}"
    assert vertices[reason].tolist() == [0] * 20 + [1]
    assert any(line.startswith("comment surface_model: 0 ") for line in lines)
    red, green, blue = (vertices[name].astype(int) for name in ("red", "green", "blue"))
    assert (red[:20] > blue[:20]).all()
    assert np.ptp([red[20], green[20], blue[20]]) < 40  # nearly grey
    found = trimesh.load(path)
    np.testing.assert_array_equal(found.vertices, curvatures.positions)


def test_a_mesh_is_saved_with_its_cells(cloud: Any, tmp_path: Path) -> None:
    mesh = cloud.level_set(include="curvatures", std=True)
    mesh.save(tmp_path / "mesh.ply")
    found = trimesh.load(tmp_path / "mesh.ply", process=False)
    np.testing.assert_array_equal(found.faces, mesh.cells)
    np.testing.assert_array_equal(found.vertices, mesh.vertices)
    read = found.metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_array_equal(read["position_std"].ravel(), mesh.position_std)
    assert set(read["support"].ravel().tolist()) <= {0, 1, 2}
    polyline = gramian.Client().cloud(CIRCLE).level_set()
    polyline.save(tmp_path / "line.ply")
    assert f"element edge {len(polyline.cells)}" in properties(tmp_path / "line.ply")[0]


def test_a_vtp_file_has_vectors(curvatures: gramian.Curvatures, tmp_path: Path) -> None:
    curvatures.save(tmp_path / "out.vtp")
    root = ElementTree.parse(tmp_path / "out.vtp").getroot()
    arrays = {each.get("Name"): each for each in root.iter("DataArray")}
    assert arrays["normals"].get("NumberOfComponents") == "3"
    assert arrays["principal_directions"].get("NumberOfComponents") == "6"
    assert arrays["colours"].get("type") == "UInt8"
    assert root.find(".//PointData").get("Scalars") == "mean_curvatures"  # type: ignore[union-attr]


def test_an_npz_file_has_the_arrays_in_their_shapes(cloud: Any, curvatures: gramian.Curvatures, tmp_path: Path) -> None:
    curvatures.save(tmp_path / "out.npz")
    with np.load(tmp_path / "out.npz") as found:
        np.testing.assert_array_equal(found["principal_directions"], curvatures.principal_directions)
        np.testing.assert_array_equal(found["positions"], curvatures.positions)
        assert found["flag_query"].tolist() == [20]
        assert json.loads(str(found["diagnostics"]))["solver"] == "local"
    sparse = cloud.laplace_beltrami_sparse_matrix()
    sparse.save(tmp_path / "matrix.npz")
    assert (scipy.sparse.load_npz(tmp_path / "matrix.npz") != sparse.matrix).nnz == 0
    with pytest.raises(ValueError, match=r"^the name of this file ends with \.npz, not as"):
        sparse.save(tmp_path / "matrix.csv")


def test_files_of_space_need_three_coordinates_that_are_known(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(30, 4))
    answer = gramian.Client().cloud(points).interpolate(points[:, 0])
    with pytest.raises(
        ValueError, match=r"has three coordinates, and the positions have 4: save them as \.csv or \.npz"
    ):
        answer.save(tmp_path / "out.ply")
    answer.save(tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text().startswith("x_0,x_1,x_2,x_3,value,flags\n")
    listed = next(each for each in gramian.Client().clouds() if each.dimension == 2 and each.n_points == 8)
    unknown = listed.interpolate(VALUES)
    assert "x" not in unknown.to_pandas()
    with pytest.raises(ValueError, match="positions=points"):
        unknown.save(tmp_path / "out.ply")
    unknown.save(tmp_path / "out.ply", positions=CIRCLE)
    with pytest.raises(ValueError, match="positions must have 8 rows, one for each query, not 3"):
        unknown.save(tmp_path / "out.ply", positions=CIRCLE[:3])


@pytest.mark.parametrize(("scale", "quantity"), [("RdYlBu_r", "mean_curvatures"), ("viridis", "values")])
def test_colours_are_those_of_the_pictures(scale: str, quantity: str) -> None:
    expected = mpl.colormaps[scale](np.linspace(0, 1, 11))[:, :3]
    anchors = np.array([list(bytes.fromhex(colour)) for colour in SCALES[scale].split()]) / 255
    assert np.abs(anchors - expected).max() < 0.01
    values = np.linspace(-1, 1, 101)
    colours = colours_of(values, None, quantity)
    assert colours[0].tolist() == (255 * anchors[0]).round().tolist()
    assert np.ptp(colours_of(values, np.full(101, np.inf), quantity).astype(int), axis=1).max() < 40
