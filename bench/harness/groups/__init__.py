"""Groups of measurements: name, title, and the function that yields the rows."""

from collections.abc import Callable, Iterable

from ..report import Row
from ..setting import Setting
from . import bodies, factor, kernels, normals, posterior, surfaces, values

GROUPS: dict[str, tuple[str, Callable[[Setting], Iterable[Row]]]] = {
    "kernels": ("Kernel evaluation, one core, d = 3", kernels.measure),
    "factor": ("Factorization and operators", factor.measure),
    "normals": ("Normals over HTTP", normals.measure),
    "posterior": ("Posteriors over HTTP, on a cached factor", posterior.measure),
    "bodies": ("Bodies", bodies.measure),
    "values": ("Peers for values, end to end from Python", values.measure),
    "surfaces": ("Peers for surfaces", surfaces.measure),
}
