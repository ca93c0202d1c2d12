"""Polynomial fits to the nearest points, in NumPy.

They are the usual first attempt at normals and curvatures, and the reference on dense scans.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree
from scipy.spatial import cKDTree

from ..clouds import Floats

#: Number of queries per block: their neighbourhoods fit into the caches.
BLOCK = 4000
N_THREADS = 2


@dataclass(frozen=True)
class Fits:
    """Unit normals `[m, 3]` and the principal curvatures for them `[m, 2]`.

    Curvatures ascend. They are positive where the surface bends away from the normal.
    """

    normals: Floats
    curvatures: Floats


def jets(points: Floats, queries: Floats, n_neighbours: int, degree: int, outward: Floats | None = None) -> Fits:
    """Fits heights over the plane of principal axes by least squares, as in Cazals and Pouget (2003).

    `outward` chooses the side of each normal. Without it the side is arbitrary.
    """
    tree = cKDTree(points)
    fits = [
        _block(
            points,
            queries[start : start + BLOCK],
            tree,
            n_neighbours,
            degree,
            None if outward is None else outward[start : start + BLOCK],
        )
        for start in range(0, len(queries), BLOCK)
    ]
    return Fits(np.concatenate([fit.normals for fit in fits]), np.concatenate([fit.curvatures for fit in fits]))


def _block(points: Floats, queries: Floats, tree: cKDTree, n_neighbours: int, degree: int, outward: Floats | None) -> Fits:
    distances, indices = tree.query(queries, n_neighbours, workers=N_THREADS)
    patches = points[indices]
    centred = patches - patches.mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", centred, centred))
    axes = axes[:, :, ::-1].copy()  # two tangents, then the normal
    if outward is not None:
        axes[np.einsum("ni,ni->n", axes[:, :, 2], outward) < 0, :, 2] *= -1
    scale = distances[:, -1]
    local = np.matmul(patches - queries[:, None], axes) / scale[:, None, None]
    s, t, heights = local[..., 0], local[..., 1], local[..., 2]
    monomials = [s ** (total - j) * t**j for total in range(degree + 1) for j in range(total + 1)]
    q, r = np.linalg.qr(np.stack(monomials, axis=-1))
    coefficients = np.linalg.solve(r, np.einsum("nki,nk->ni", q, heights)[..., None])[..., 0]
    z_s, z_t = coefficients[:, 1], coefficients[:, 2]
    z_ss, z_st, z_tt = (factor * coefficients[:, k] / scale for k, factor in ((3, 2), (4, 1), (5, 2)))
    normals = np.einsum("nij,nj->ni", axes, np.column_stack([-z_s, -z_t, np.ones_like(z_s)]))
    lengths = np.linalg.norm(normals, axis=1)
    mean = -((1 + z_t**2) * z_ss - 2 * z_s * z_t * z_st + (1 + z_s**2) * z_tt) / (2 * lengths**3)
    gaussian = (z_ss * z_tt - z_st**2) / lengths**4
    half = np.sqrt(np.maximum(mean**2 - gaussian, 0))
    return Fits(normals / lengths[:, None], np.column_stack([mean - half, mean + half]))


def oriented(points: Floats, normals: Floats, n_neighbours: int = 12) -> Floats:
    """Orients normals so that signs agree along a minimum spanning tree of nearest neighbours (Hoppe 1992).

    Edges between parallel normals weigh least.
    """
    _, indices = cKDTree(points).query(points, n_neighbours, workers=N_THREADS)
    n = len(points)
    heads, tails = np.repeat(np.arange(n), n_neighbours - 1), indices[:, 1:].ravel()
    weights = 1 + 1e-9 - np.abs(np.einsum("ni,ni->n", normals[heads], normals[tails]))
    tree = minimum_spanning_tree(coo_matrix((weights, (heads, tails)), shape=(n, n)).tocsr())
    signs = np.zeros(n)
    while signs[start := int(np.argmin(np.abs(signs)))] == 0:
        order, before = breadth_first_order(tree, start, directed=False)
        nodes, parents = order[1:], before[order[1:]]
        agreements = np.sign(np.einsum("ni,ni->n", normals[nodes], normals[parents]))
        signs[start] = 1
        for node, parent, agreement in zip(nodes, parents, agreements, strict=True):
            signs[node] = signs[parent] * (agreement or 1)
    return normals * signs[:, None]
