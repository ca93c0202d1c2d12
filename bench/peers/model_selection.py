"""Compares model selection with scikit-learn on regression sets of its package.

    cargo build --release --example model_selection
    bench/.venv/bin/python bench/peers/model_selection.py \
        target/release/examples/model_selection [--restarts N]

Prints the greatest log marginal likelihood that each finds, and the time to find it.

Coordinates and values are standardised. Kernels are a variance times Gauss or Matern 5/2 with a length scale
for each axis, plus noise. Both programs have the same start, bounds and number of restarts. The restarts
themselves differ. Times are the best of several rounds that take turns. scikit-learn runs on one thread and
on all, and the faster time counts.
"""

import argparse
import os
import subprocess
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
from sklearn.datasets import load_diabetes, load_linnerud, make_friedman1, make_friedman2, make_friedman3, make_regression
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel
from threadpoolctl import threadpool_limits

N_MADE = 400
LENGTH_SCALES, VARIANCE, NOISE = (1e-2, 1e3), (1e-3, 1e3), (1e-5, 1e1)


def sets() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    linnerud = load_linnerud()
    return {
        "diabetes": load_diabetes(return_X_y=True),
        "linnerud": (linnerud.data, linnerud.target[:, 0]),
        "friedman1": make_friedman1(N_MADE, noise=1.0, random_state=0),
        "friedman2": make_friedman2(N_MADE, noise=50.0, random_state=0),
        "friedman3": make_friedman3(N_MADE, noise=0.1, random_state=0),
        "regression": make_regression(N_MADE, 8, n_informative=4, noise=20.0, random_state=0),
    }


def standardised(a: np.ndarray) -> np.ndarray:
    return (a - a.mean(axis=0)) / a.std(axis=0)


def by_scikit_learn(x: np.ndarray, y: np.ndarray, family: str, restarts: int, n_threads: int) -> tuple[float, float]:
    ones = np.ones(x.shape[1])
    correlation = RBF(ones, LENGTH_SCALES) if family == "gauss" else Matern(ones, LENGTH_SCALES, nu=2.5)
    kernel = ConstantKernel(1.0, VARIANCE) * correlation + WhiteKernel(0.1, NOISE)
    process = GaussianProcessRegressor(kernel, alpha=0.0, n_restarts_optimizer=restarts, random_state=0)
    with threadpool_limits(n_threads):
        began = time.perf_counter()
        process.fit(x, y)
        return process.log_marginal_likelihood_value_, time.perf_counter() - began


def by_gramian(binary: Path, x: np.ndarray, y: np.ndarray, family: str, restarts: int) -> tuple[float, float, int, str]:
    with tempfile.NamedTemporaryFile(suffix=".csv") as file:
        np.savetxt(file.name, np.column_stack([x, y]), delimiter=",", fmt="%.17g")
        command = [binary, file.name, family, str(restarts)]
        lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    score, seconds, evaluations, converged = lines[0].split()
    return float(score), float(seconds), int(evaluations), converged


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("binary", type=Path)
    parser.add_argument("--restarts", type=int, default=4)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    threads = sorted({1, os.cpu_count() or 1})
    # Length scales of irrelevant axes end at their bounds, of which scikit-learn warns.
    warnings.simplefilter("ignore", ConvergenceWarning)
    print("| set | n | d | kernel | ours | scikit-learn | difference | ours | scikit-learn | times faster | evaluations | converged |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for name, (x, y) in sets().items():
        x, y = standardised(x), standardised(y)
        for family in ("gauss", "matern"):
            peer, mine = [], []
            for _ in range(arguments.rounds):
                peer += [by_scikit_learn(x, y, family, arguments.restarts, n_threads) for n_threads in threads]
                mine.append(by_gramian(arguments.binary, x, y, family, arguments.restarts))
            theirs, their_seconds = peer[0][0], min(seconds for _, seconds in peer)
            ours, _, evaluations, converged = mine[0]
            seconds = min(run[1] for run in mine)
            print(
                f"| {name} | {len(y)} | {x.shape[1]} | {family} | {ours:.6f} | {theirs:.6f} | {ours - theirs:+.1e} | {seconds:.3f} s "
                f"| {their_seconds:.2f} s | {their_seconds / seconds:.1f} | {evaluations} | {converged} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
