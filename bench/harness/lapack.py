"""LAPACK of SciPy's OpenBLAS as a child process: `python -m harness.lapack N LENGTH_SCALE ALPHA`.

The matrix is the Matérn 5/2 matrix of the sphere with N points. Each line on standard input,
`ROUTINE THREADS [COLUMNS]`, is answered with the seconds of one call on warm memory. LAPACK runs in a
separate process, so that its threads do not linger in ours.
"""

import sys
import time
from collections.abc import Callable

import numpy as np
from scipy.linalg import blas, lapack
from threadpoolctl import threadpool_info, threadpool_limits

from .clouds import Floats, matern_gram, sphere
from .timing import SPIN_SECONDS

READ_BYTES = 512 << 20


class Routines:
    """The matrix, its factor, and a work array."""

    def __init__(self, n: int, length_scale: float, alpha: float) -> None:
        self.matrix = matern_gram(sphere(n), length_scale, alpha)
        self.factor = self._factorize(self.matrix.copy(order="F"))
        self.work = np.empty_like(self.matrix)

    @staticmethod
    def _factorize(matrix: Floats) -> Floats:
        factor, info = lapack.dpotrf(matrix, lower=1, overwrite_a=1, clean=0)
        if info != 0:
            raise ArithmeticError(f"dpotrf: {info}")
        return factor

    def prepare(self, routine: str, n_columns: int) -> Callable[[], object]:
        """Fills the work array and returns the call to be timed."""
        n = len(self.matrix)
        if routine == "dpotrf":
            np.copyto(self.work, self.matrix)
            return lambda: self._factorize(self.work)
        if routine == "dgemm":
            return lambda: blas.dgemm(1.0, self.matrix, self.matrix, c=self.work, overwrite_c=1)
        if routine == "read":
            vector = self.vector()
            return lambda: blas.ddot(vector, vector)
        columns = self.work.reshape(-1, order="F")[: n * n_columns].reshape((n, n_columns), order="F")
        columns[:] = self.matrix[:, :n_columns]
        if routine == "dpotrs":
            return lambda: lapack.dpotrs(self.factor, columns, lower=1, overwrite_b=1)
        if routine == "dtrsm":
            return lambda: blas.dtrsm(1.0, self.factor, columns, lower=1, overwrite_b=1)
        raise ValueError(routine)

    def vector(self) -> Floats:
        """Returns a vector too large for any cache."""
        if not hasattr(self, "_vector"):
            self._vector = np.ones(READ_BYTES // 8)
        return self._vector


def openblas_core() -> str:
    """Returns the name of the kernels that OpenBLAS chose for this machine."""
    cores = [entry["architecture"] for entry in threadpool_info() if entry["internal_api"] == "openblas"]
    return cores[0] if cores else "unknown"


def main() -> None:
    routines = Routines(int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]))
    for line in sys.stdin:
        routine, n_threads, *rest = line.split()
        call = routines.prepare(routine, int(rest[0]) if rest else 0)
        with threadpool_limits(int(n_threads), user_api="blas"):
            began = time.perf_counter()
            call()
            seconds = time.perf_counter() - began
        time.sleep(SPIN_SECONDS)
        print(f"{routine}\t{seconds:.9f}\ts\n", flush=True)


if __name__ == "__main__":
    main()
