"""Gaussian processes and interpolation beside scikit-learn, SciPy and GPyTorch, end to end from Python.

Our time includes encoding the request, HTTP, and decoding the answer to arrays. Each call deletes its results
afterwards, so that every call is cold. Our time includes that too.
"""

import importlib.util
import json
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from safetensors.numpy import load as load_safetensors
from safetensors.numpy import save as save_safetensors
from scipy.interpolate import RBFInterpolator
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import Matern

from ..clouds import Floats, cube, wave
from ..report import Bound, Figure, Row
from ..server import Client, Refused, encode
from ..setting import Setting
from ..timing import SPIN_SECONDS, alternate, timed

LENGTH_SCALE, ALPHA = 0.3, 1e-6
MATERN = {"family": "matern", "nu": 2.5, "length_scale": LENGTH_SCALE}

#: Length scale short enough for SciPy's solver, which has almost no regularization.
GAUSS_LENGTH_SCALE, SMOOTHING = 0.15, 1e-10

#: Function from points, values and queries to means and, for a posterior, standard deviations.
Method = Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]

SAFETENSORS = "application/x-safetensors"


def measure(setting: Setting) -> Iterable[Row]:
    with setting.gramian() as server:
        yield from posteriors(setting, server.client())
        yield from interpolants(setting, server.client())


def posteriors(setting: Setting, client: Client) -> Iterable[Row]:
    n, m = setting.size(2000), setting.size(1000, 200)
    methods: dict[str, Method] = {
        "ours": lambda *data: by_json(client, posterior_request(*data), encode),
        "ours, json": lambda *data: by_json(client, posterior_request(*data), encode_by_standard_library),
        "scikit-learn": by_scikit_learn,
    }
    if serves_safetensors(client):
        methods["ours, safetensors"] = lambda *data: by_safetensors(client, *data)
    if setting.with_gpytorch and importlib.util.find_spec("gpytorch"):
        from ..gpytorch_peer import matern
        from ..gpytorch_peer import posterior as by_gpytorch

        methods["GPyTorch"] = lambda *data: by_gpytorch(*data, matern(LENGTH_SCALE), ALPHA)
    times, results = run(setting.rounds(4), methods, n, m)
    what = f"posterior mean and deviation, n = {n:,}, m = {m:,}"
    peer = Figure.of(times["scikit-learn"])
    agreement = agree(results, "scikit-learn")
    yield Row(
        f"{what}: scikit-learn",
        Figure.of(times["ours"]),
        peer,
        Bound("speedup", "≥", 4),
        f"JSON by orjson; {agreement}",
        is_contest=True,
    )
    yield Row(f"{what}: scikit-learn, JSON by the standard library", Figure.of(times["ours, json"]), peer, is_contest=True)
    if "ours, safetensors" in times:
        yield Row(f"{what}: scikit-learn, safetensors", Figure.of(times["ours, safetensors"]), peer, is_contest=True)
    else:
        yield Row(f"{what}: scikit-learn, safetensors", None, peer, remark="not served")
    if "GPyTorch" in times:
        agreement = agree(results, "GPyTorch")
        yield Row(
            f"{what}: GPyTorch, exact",
            Figure.of(times["ours"]),
            Figure.of(times["GPyTorch"]),
            None,
            agreement,
            is_contest=True,
        )
    else:
        yield Row(f"{what}: GPyTorch, exact", None, remark="only with `bench/run --with-gpytorch`")


def interpolants(setting: Setting, client: Client) -> Iterable[Row]:
    n, m = setting.size(2000), setting.size(1000, 200)
    kernel = {"family": "gauss", "length_scale": GAUSS_LENGTH_SCALE}

    def ours(points: Floats, values: Floats, queries: Floats) -> tuple[Floats, Floats]:
        request = {
            "cloud": {"points": points},
            "kernel": kernel,
            "alpha": SMOOTHING,
            "values": values,
            "queries": queries,
        }
        answer = client.post("/v1/interpolation", request).json()
        return np.array(answer["values"]), forgotten(client, answer)

    def scipy(points: Floats, values: Floats, queries: Floats) -> tuple[Floats, Floats]:
        # Degree −1 uses the kernel alone, as ours does. The default would add a constant.
        interpolator = RBFInterpolator(
            points, values, smoothing=SMOOTHING, kernel="gaussian", epsilon=1 / GAUSS_LENGTH_SCALE, degree=-1
        )
        return interpolator(queries), np.empty(0)

    times, results = run(setting.rounds(4), {"ours": ours, "SciPy": scipy}, n, m)
    yield Row(
        f"interpolation, Gauss, n = {n:,}, m = {m:,}: SciPy RBFInterpolator",
        Figure.of(times["ours"]),
        Figure.of(times["SciPy"]),
        Bound("speedup", "≥", 3),
        f"JSON by orjson; greatest difference {differ(results, 'SciPy', 0)}",
        is_contest=True,
    )


def run(n_rounds: int, methods: dict[str, Method], n: int, m: int) -> tuple[dict[str, Any], dict[str, tuple[Floats, Floats]]]:
    """Returns times by method, and the results of the last round."""
    results: dict[str, tuple[Floats, Floats]] = {}

    def ask(name: str, method: Method, round_number: int) -> float:
        points, queries = cube(n, round_number), cube(m, 1000 + round_number)
        results[name], seconds = timed(lambda: method(points, wave(points), queries))
        return seconds

    tasks = {name: lambda number, n=name, f=method: ask(n, f, number) for name, method in methods.items()}
    return alternate(n_rounds, tasks, SPIN_SECONDS), results


def posterior_request(points: Floats, values: Floats, queries: Floats) -> dict[str, Any]:
    return {
        "cloud": {"points": points},
        "kernel": MATERN,
        "alpha": ALPHA,
        "values": values,
        "queries": queries,
        "include": ["variance"],
    }


def by_json(client: Client, request: dict[str, Any], to_json: Callable[[Any], bytes]) -> tuple[Floats, Floats]:
    answer = client.request("POST", "/v1/posterior", to_json(request)).json()
    forgotten(client, answer)
    return np.array(answer["means"]), np.sqrt(np.array(answer["variances"]))


def encode_by_standard_library(request: Any) -> bytes:
    return json.dumps(request, default=lambda array: array.tolist()).encode()


def by_safetensors(client: Client, points: Floats, values: Floats, queries: Floats) -> tuple[Floats, Floats]:
    fields = {"kernel": MATERN, "alpha": ALPHA, "include": ["variance"]}
    body = save_safetensors({"cloud.points": points, "values": values, "queries": queries}, {"request": json.dumps(fields)})
    headers = {"Content-Type": SAFETENSORS, "Accept": SAFETENSORS}
    answer = client.request("POST", "/v1/posterior", body, headers)
    if answer.status != 200:
        raise Refused(f"{answer.status}")
    tensors = load_safetensors(answer.body)
    n_header = int.from_bytes(answer.body[:8], "little")
    forgotten(client, json.loads(json.loads(answer.body[8 : 8 + n_header])["__metadata__"]["response"]))
    return tensors["means"], np.sqrt(tensors["variances"])


def serves_safetensors(client: Client) -> bool:
    try:
        by_safetensors(client, cube(10, 0), np.ones(10), cube(2, 1))
    except Refused:
        return False
    return True


def by_scikit_learn(points: Floats, values: Floats, queries: Floats) -> tuple[Floats, Floats]:
    process = GaussianProcessRegressor(Matern(length_scale=LENGTH_SCALE, nu=2.5), alpha=ALPHA, optimizer=None)
    return process.fit(points, values).predict(queries, return_std=True)


def forgotten(client: Client, answer: dict[str, Any]) -> Floats:
    """Deletes the cloud, and returns an empty array. The time counts as ours."""
    client.request("DELETE", f"/v1/clouds/{answer['diagnostics']['cloud_id']}")
    return np.empty(0)


def agree(results: dict[str, tuple[Floats, Floats]], peer: str) -> str:
    means, deviations = (differ(results, peer, part) for part in (0, 1))
    return f"greatest difference of the means {means}, of the deviations {deviations}"


def differ(results: dict[str, tuple[Floats, Floats]], peer: str, part: int) -> str:
    return f"{np.max(np.abs(results['ours'][part] - results[peer][part])):.1e}"
