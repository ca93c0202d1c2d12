"""Point clouds with known geometry, and the kernel matrix of one."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

GOLDEN = np.pi * (1 + np.sqrt(5))
TORUS_RADII = (1.0, 0.4)


def sphere(n: int, angle: float = 0.0) -> Floats:
    """Returns n points on the unit sphere, `[n, 3]`: a Fibonacci spiral turned by `angle` (radians).

    benches/support makes the same points.
    """
    i = np.arange(n)
    z = 1 - (2 * i + 1) / n
    r, t = np.sqrt(1 - z * z), GOLDEN * i + angle
    return np.column_stack([r * np.cos(t), r * np.sin(t), z])


def cube(n: int, seed: int) -> Floats:
    """Returns n random points in the unit cube, `[n, 3]`."""
    return np.random.default_rng(seed).random((n, 3))


def torus(n: int, seed: int = 0) -> tuple[Floats, Floats, Floats]:
    """Returns random points on a torus `[n, 3]`, outward normals `[n, 3]` and curvatures `[n, 2]`.

    The points are uniform by area. The principal curvatures ascend: cos v/(R + r cos v) and 1/r.
    """
    major, minor = TORUS_RADII
    random = np.random.default_rng(seed)
    v = random.uniform(0, 2 * np.pi, 4 * n)
    v = v[random.uniform(0, major + minor, 4 * n) < major + minor * np.cos(v)][:n]
    u = random.uniform(0, 2 * np.pi, n)
    distance = major + minor * np.cos(v)
    points = np.column_stack([distance * np.cos(u), distance * np.sin(u), minor * np.sin(v)])
    normals = np.column_stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)])
    curvatures = np.column_stack([np.cos(v) / distance, np.full(n, 1 / minor)])
    return points, normals, curvatures


def matern_gram(points: Floats, length_scale: float, alpha: float) -> Floats:
    """Returns the Matérn 5/2 matrix K + αI in column-major order.

    k(x, y) = (1 + s + s²/3) e^{−s} with s = √5 |x − y|/ℓ.
    """
    squares = np.sum(points**2, axis=1)
    squared = np.maximum(squares[:, None] + squares[None, :] - 2 * points @ points.T, 0)
    s = np.sqrt(5 * squared) / length_scale
    gram = (1 + s + s * s / 3) * np.exp(-s)
    gram[np.diag_indices(len(points))] = 1 + alpha
    return np.asfortranarray(gram)


def harmonic(points: Floats) -> Floats:
    """Evaluates xyz, a spherical harmonic of degree 3 on the unit sphere: Δ(xyz) = −12 xyz."""
    return np.prod(points, axis=1)


def wave(points: Floats) -> Floats:
    """Evaluates sin 3x + z cos 2y, a smooth function in space."""
    return np.sin(3 * points[:, 0]) + np.cos(2 * points[:, 1]) * points[:, 2]
