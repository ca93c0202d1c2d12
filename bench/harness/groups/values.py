"""Gaussian processes and interpolation beside scikit-learn, SciPy and GPyTorch, end to end from Python.

Our time includes encoding the request, HTTP, and decoding the answer to arrays. Each call deletes its results
afterwards, so that every call is cold. Our time includes that too.
"""

import importlib.util
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from safetensors.numpy import load as load_safetensors
from safetensors.numpy import save as save_safetensors
from scipy.interpolate import RBFInterpolator
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, Matern

from ..clouds import Floats, cube, wave
from ..report import Bound, Figure, Row
from ..server import Client, Refused, encode
from ..setting import Setting
from ..timing import SPIN_SECONDS, alternate, timed

@dataclass(frozen=True)
class Process:
    """Kernel and noise of a request, and the bound of our speedup over the peer."""

    kernel: dict[str, Any]
    alpha: float
    bound: Bound

    @property
    def what(self) -> str:
        return {"gauss": "Gauss", "matern": "Matérn"}[self.kernel["family"]] + f" ℓ = {self.kernel['length_scale']}, α = {self.alpha:g}"

    @property
    def of_scikit_learn(self) -> Any:
        """The same kernel in scikit-learn, whose Gaussian is exp(−r²/2ℓ²)."""
        length_scale = self.kernel["length_scale"]
        return Matern(length_scale, nu=2.5) if self.kernel["family"] == "matern" else RBF(length_scale / np.sqrt(2))


#: A kernel whose rank is that of the points.
ROUGH = Process({"family": "matern", "nu": 2.5, "length_scale": 0.3}, 1e-6, Bound("speedup", "≥", 4))

#: Length scale short enough for SciPy's solver, which has almost no regularization.
SHORT = Process({"family": "gauss", "length_scale": 0.15}, 1e-10, Bound("speedup", "≥", 3))

#: A kernel that some 300 landmarks span. Requests do not name the solver.
SMOOTH_POSTERIOR, SMOOTH = (Process({"family": "gauss", "length_scale": 1.0}, 1e-2, Bound("speedup", "≥", bound)) for bound in (6, 5))

#: Function from points, values and queries to means and, for a posterior, standard deviations.
Method = Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]

SAFETENSORS = "application/x-safetensors"


def measure(setting: Setting) -> Iterable[Row]:
    with setting.gramian() as server:
        client = server.client()
        yield from posteriors(setting, client)
        yield from smooth_posterior(setting, client)
        for process in (SHORT, SMOOTH):
            yield interpolant(setting, client, process)


def posteriors(setting: Setting, client: Client) -> Iterable[Row]:
    n, m = setting.size(2000), setting.size(1000, 200)
    methods: dict[str, Method] = {
        "ours": lambda *data: by_json(client, posterior_request(ROUGH, *data), encode),
        "ours, json": lambda *data: by_json(client, posterior_request(ROUGH, *data), encode_by_standard_library),
        "scikit-learn": lambda *data: by_scikit_learn(ROUGH, *data),
    }
    if serves_safetensors(client):
        methods["ours, safetensors"] = lambda *data: by_safetensors(client, *data)
    if setting.with_gpytorch and importlib.util.find_spec("gpytorch"):
        from ..gpytorch_peer import matern
        from ..gpytorch_peer import posterior as by_gpytorch

        methods["GPyTorch"] = lambda *data: by_gpytorch(*data, matern(ROUGH.kernel["length_scale"]), ROUGH.alpha)
    times, results = run(setting.rounds(4), methods, n, m)
    what = f"posterior mean and deviation, n = {n:,}, m = {m:,}"
    peer = Figure.of(times["scikit-learn"])
    agreement = agree(results, "scikit-learn")
    yield Row(
        f"{what}: scikit-learn",
        Figure.of(times["ours"]),
        peer,
        ROUGH.bound,
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


def smooth_posterior(setting: Setting, client: Client) -> Iterable[Row]:
    process, n, m = SMOOTH_POSTERIOR, setting.size(2000), setting.size(1000, 200)
    methods: dict[str, Method] = {
        "ours": lambda *data: by_json(client, posterior_request(process, *data), encode),
        "scikit-learn": lambda *data: by_scikit_learn(process, *data),
    }
    times, results = run(setting.rounds(4), methods, n, m)
    yield Row(
        f"the same, {process.what}: scikit-learn",
        Figure.of(times["ours"]),
        Figure.of(times["scikit-learn"]),
        process.bound,
        f"JSON by orjson; {agree(results, 'scikit-learn')}",
        is_contest=True,
    )


def interpolant(setting: Setting, client: Client, process: Process) -> Row:
    n, m = setting.size(2000), setting.size(1000, 200)

    def ours(points: Floats, values: Floats, queries: Floats) -> tuple[Floats, Floats]:
        request = request_of(process, points, values, queries)
        answer = client.post("/v1/interpolation", request).json()
        return np.array(answer["values"]), forgotten(client, answer)

    def scipy(points: Floats, values: Floats, queries: Floats) -> tuple[Floats, Floats]:
        # Degree −1 uses the kernel alone, as ours does. The default would add a constant.
        epsilon = 1 / process.kernel["length_scale"]
        interpolator = RBFInterpolator(
            points, values, smoothing=process.alpha, kernel="gaussian", epsilon=epsilon, degree=-1
        )
        return interpolator(queries), np.empty(0)

    times, results = run(setting.rounds(4), {"ours": ours, "SciPy": scipy}, n, m)
    return Row(
        f"interpolation, {process.what}, n = {n:,}, m = {m:,}: SciPy RBFInterpolator",
        Figure.of(times["ours"]),
        Figure.of(times["SciPy"]),
        process.bound,
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


def posterior_request(process: Process, points: Floats, values: Floats, queries: Floats) -> dict[str, Any]:
    return {**request_of(process, points, values, queries), "include": ["variances"]}


def request_of(process: Process, points: Floats, values: Floats, queries: Floats) -> dict[str, Any]:
    """Returns a request that names kernel and noise, and leaves the solver to the service."""
    fit = {"kernel": process.kernel, "alpha": process.alpha}
    return {"cloud": {"points": points}, **fit, "values": values, "queries": queries}


def by_json(client: Client, request: dict[str, Any], to_json: Callable[[Any], bytes]) -> tuple[Floats, Floats]:
    answer = client.request("POST", "/v1/posterior", to_json(request)).json()
    forgotten(client, answer)
    return np.array(answer["means"]), np.sqrt(np.array(answer["variances"]))


def encode_by_standard_library(request: Any) -> bytes:
    return json.dumps(request, default=lambda array: array.tolist()).encode()


def by_safetensors(client: Client, points: Floats, values: Floats, queries: Floats) -> tuple[Floats, Floats]:
    fields = {"kernel": ROUGH.kernel, "alpha": ROUGH.alpha, "include": ["variances"]}
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


def by_scikit_learn(process: Process, points: Floats, values: Floats, queries: Floats) -> tuple[Floats, Floats]:
    peer = GaussianProcessRegressor(process.of_scikit_learn, alpha=process.alpha, optimizer=None)
    return peer.fit(points, values).predict(queries, return_std=True)


def forgotten(client: Client, answer: dict[str, Any]) -> Floats:
    """Deletes the cloud, and returns an empty array. The time counts as ours."""
    client.request("DELETE", f"/v1/clouds/{answer['diagnostics']['cloud_id']}")
    return np.empty(0)


def agree(results: dict[str, tuple[Floats, Floats]], peer: str) -> str:
    means, deviations = (differ(results, peer, part) for part in (0, 1))
    return f"greatest difference of the means {means}, of the deviations {deviations}"


def differ(results: dict[str, tuple[Floats, Floats]], peer: str, part: int) -> str:
    return f"{np.max(np.abs(results['ours'][part] - results[peer][part])):.1e}"
