"""Prints the rightmost eigenvalues of the matrices that examples/stability_sweep.rs wrote, and the growth of
random values over 1,000 steps of backward Euler.

Run `python3 numerics/examples/rightmost.py FOLDER [part of a name]`.

Dense eigenvalues are computed up to 2,000 points. Beyond, Arnoldi's method with shift and invert finds the
eigenvalues nearest to s. An eigenvalue with positive real part, however large its imaginary part, lies in the
disc |z - s| < s for a large enough s. The norm of the matrix and two smaller numbers are tried as s. Constants
have the eigenvalue 0, at the distance s, so no eigenvalue may be nearer.
"""

import pathlib
import sys

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

DENSE = 2000


def read(folder):
    indptr, indices = (np.fromfile(folder / name, "<i8") for name in ("indptr", "indices"))
    n = len(indptr) - 1
    return sparse.csr_matrix((np.fromfile(folder / "data", "<f8"), indices, indptr), (n, n))


def rightmost(matrix):
    n = matrix.shape[0]
    if n <= DENSE:
        return np.linalg.eigvals(matrix.toarray()).real.max()
    norm, found = linalg.norm(matrix, np.inf), []
    for shift in (norm, norm / 30, norm / 1000):
        factor = linalg.splu((matrix - shift * sparse.identity(n)).tocsc())
        inverse = linalg.LinearOperator((n, n), matvec=factor.solve)
        values = linalg.eigs(inverse, k=2, ncv=30, tol=1e-6, return_eigenvectors=False)
        found.extend(shift + 1 / values)
    return np.real(found).max()


def growth(matrix, step, n_steps=1000):
    """Returns the largest max norm over all steps of backward Euler, relative to that of the random start."""
    factor = linalg.splu((sparse.identity(matrix.shape[0]) - step * matrix).tocsc())
    values = np.random.default_rng(0).uniform(-1, 1, matrix.shape[0])
    start, most = np.abs(values).max(), 0.0
    for _ in range(n_steps):
        values = factor.solve(values)
        most = max(most, np.abs(values).max())
    return most / start


print("| cloud | norm | rightmost | growth, step 1e-3 | 1e-2 |\n|---|---|---|---|---|")
for folder in sorted(pathlib.Path(sys.argv[1]).iterdir()):
    if len(sys.argv) > 2 and sys.argv[2] not in folder.name:
        continue
    matrix = read(folder)
    steps = " | ".join(f"{growth(matrix, step):.2f}" for step in (1e-3, 1e-2))
    norm = linalg.norm(matrix, np.inf)
    print(f"| {folder.name} | {norm:.3g} | {rightmost(matrix):.2g} | {steps} |", flush=True)
