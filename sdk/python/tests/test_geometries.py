"""Meshes and clouds of other libraries go in as they are, with their normals."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from sent import posted, sent

import gramian
from gramian.arguments.geometries import geometry_of

BALL = trimesh.creation.icosphere(2)
VERTICES, NORMALS = np.array(BALL.vertices), np.array(BALL.vertex_normals)


def data_set(**arrays: Any) -> Any:
    """Returns a geometry with the members of data sets of PyVista and meshes of meshio."""
    return SimpleNamespace(points=VERTICES, point_data=arrays)


def open3d(*, has_normals: bool) -> Any:
    """Returns a geometry with the members of Open3D's meshes, whose vectors NumPy reads through a buffer."""
    rows = NORMALS if has_normals else np.empty((0, 3))
    return SimpleNamespace(
        vertices=memoryview(VERTICES.tobytes()).cast("d", VERTICES.shape),
        vertex_normals=rows,
        has_vertex_normals=lambda: has_normals,
    )


def turned() -> trimesh.Trimesh:
    """Returns a mesh with one triangle inside out."""
    faces = np.array(BALL.faces)
    faces[0] = faces[0, ::-1]
    return trimesh.Trimesh(VERTICES, faces, process=False)


GEOMETRIES: dict[str, tuple[Any, bool]] = {
    "mesh of trimesh": (BALL, True),
    "mesh of trimesh without a side": (turned(), False),
    "mesh of trimesh with a loose vertex": (trimesh.Trimesh(VERTICES, BALL.faces[1:7], process=False), False),
    "cloud of trimesh": (trimesh.PointCloud(VERTICES), False),
    "scene of trimesh": (trimesh.Scene(BALL), True),
    "data set with normals": (data_set(Normals=NORMALS), True),
    "data set": (data_set(), False),
    "mesh of Open3D with normals": (open3d(has_normals=True), True),
    "mesh of Open3D": (open3d(has_normals=False), False),
}


@pytest.mark.parametrize(("geometry", "has_normals"), GEOMETRIES.values(), ids=GEOMETRIES)
def test_a_geometry_is_its_vertices_and_normals(geometry: Any, has_normals: bool) -> None:
    body = posted(geometry)
    np.testing.assert_array_equal(body["points"], VERTICES)
    assert ("normals" in body) == has_normals
    if has_normals:
        np.testing.assert_allclose(body["normals"], NORMALS, atol=1e-12)


def test_given_normals_replace_those_of_a_mesh() -> None:
    body = posted(BALL, -NORMALS)
    np.testing.assert_array_equal(body["normals"], -NORMALS)


def test_geometries_are_queries_too() -> None:
    flat = SimpleNamespace(points=[[1.0, 0.0], [0.0, 1.0]])
    assert sent("normals", queries=flat)["queries"] == [[1.0, 0.0], [0.0, 1.0]]


@pytest.mark.parametrize(
    "value", [[[0.0, 1.0]], np.zeros((2, 3)), {"points": 1}, BALL.vertices, "scan.ply", b"ply"], ids=str
)
def test_arrays_and_tables_are_no_geometries(value: Any) -> None:
    assert geometry_of(value) is None


def test_the_mesh_of_an_answer_goes_in_again() -> None:
    mesh = gramian.Client().cloud(BALL).level_set()
    again = gramian.Client().cloud(mesh.to_trimesh())
    assert again.n_points == len(mesh.vertices)
    assert gramian.Client().cloud(mesh).id == gramian.Client().cloud(mesh.vertices).id
    assert np.median(again.curvatures().mean_curvatures) == pytest.approx(1, rel=0.01)
