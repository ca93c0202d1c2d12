"""What holds of a triangle mesh: its topology, its shape, and its distance from another one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from ..clouds import Floats

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Mesh:
    """Vertices `[k, 3]` and the three vertices of each triangle `[l, 3]`."""

    vertices: Floats
    cells: Integers


@dataclass(frozen=True)
class Topology:
    """The Euler characteristic of each part, largest first, and what keeps the mesh from being closed.

    `n_unpaired` counts directed edges without exactly one opposite. `n_pinched` counts the fans of triangles
    beyond the first at a vertex. `volume` is positive if the triangles run counter-clockwise seen from
    outside.
    """

    characteristics: tuple[int, ...]
    n_unpaired: int
    n_pinched: int
    volume: float

    @property
    def is_closed(self) -> bool:
        return self.n_unpaired == 0 and self.n_pinched == 0 and self.volume > 0


def topology(mesh: Mesh) -> Topology:
    """Counts vertices, edges and triangles of each part, and looks at each edge and vertex."""
    n_vertices = len(mesh.vertices)
    starts, ends = mesh.cells.ravel(), np.roll(mesh.cells, -1, axis=1).ravel()
    keys, counts = np.unique(starts * n_vertices + ends, return_counts=True)
    opposite = (keys % n_vertices) * n_vertices + keys // n_vertices
    is_paired = np.isin(opposite, keys) & (counts == 1)

    n_parts, of_vertex = components(n_vertices, starts, ends)
    edges = np.unique(np.minimum(starts, ends) * n_vertices + np.maximum(starts, ends)) // n_vertices
    n_cells = np.bincount(of_vertex[mesh.cells[:, 0]], minlength=n_parts)
    sizes = np.bincount(of_vertex, minlength=n_parts) - np.bincount(of_vertex[edges], minlength=n_parts) + n_cells
    largest_first = np.argsort(-n_cells, kind="stable")

    a, b, c = (mesh.vertices[mesh.cells[:, corner]] for corner in range(3))
    volume = float(np.einsum("ij,ij->", np.cross(a, b), c)) / 6
    return Topology(
        tuple(sizes[largest_first].tolist()), int((~is_paired).sum()), fans(mesh) - len(np.unique(mesh.cells)), volume
    )


def fans(mesh: Mesh) -> int:
    """Counts the fans of triangles around all vertices: corners at one vertex that edges connect."""
    n_vertices, n_corners = len(mesh.vertices), mesh.cells.size
    corners = np.arange(n_corners).reshape(-1, 3)
    starts, ends = mesh.cells.ravel(), np.roll(mesh.cells, -1, axis=1).ravel()
    at_start, at_end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    order = np.argsort(np.minimum(starts, ends) * n_vertices + np.maximum(starts, ends), kind="stable")
    keys = (np.minimum(starts, ends) * n_vertices + np.maximum(starts, ends))[order]
    is_same = keys[1:] == keys[:-1]
    one, other = order[:-1][is_same], order[1:][is_same]
    # The corners of two triangles at the same end of their common edge.
    is_turned = starts[one] != starts[other]
    first = np.where(is_turned, at_end[other], at_start[other])
    second = np.where(is_turned, at_start[other], at_end[other])
    found, _ = components(n_corners, np.concatenate([at_start[one], at_end[one]]), np.concatenate([first, second]))
    return found


def components(n: int, starts: Integers, ends: Integers) -> tuple[int, NDArray[np.int32]]:
    """Returns the number of connected components of a graph, and the component of each node."""
    graph = csr_matrix((np.ones(len(starts), dtype=np.int8), (starts, ends)), shape=(n, n))
    found: tuple[int, NDArray[np.int32]] = connected_components(graph, directed=False)
    return found


def angles(mesh: Mesh) -> Floats:
    """Returns the three angles of each triangle, in degrees."""
    corners = mesh.vertices[mesh.cells]
    u = np.roll(corners, -1, axis=1) - corners
    v = np.roll(corners, 1, axis=1) - corners
    sines = np.linalg.norm(np.cross(u, v), axis=2)
    return np.degrees(np.arctan2(sines, np.einsum("ijk,ijk->ij", u, v)))


def distances(points: Floats, mesh: Mesh) -> Floats:
    """Returns the distance of each point from the nearest triangle, in single precision."""
    import open3d.core
    import open3d.t.geometry as geometry

    scene = geometry.RaycastingScene()
    vertices, cells = mesh.vertices.astype(np.float32), mesh.cells.astype(np.uint32)
    scene.add_triangles(open3d.core.Tensor(vertices), open3d.core.Tensor(cells))
    return scene.compute_distance(open3d.core.Tensor(points.astype(np.float32))).numpy().astype(np.float64)
