"""Encoding of requests and decoding of answers, in safetensors or JSON.

JSON is used where the package safetensors is absent or a request has no arrays.

In safetensors the arrays of a request are tensors, named by their path in the JSON document (`cloud.points`).
All other fields are JSON text in the metadata entry `request`. An answer has the entry `response`, and NaN
where JSON has null. In both formats numbers are float64 and keep every bit. The integers of sparse matrices
are int64.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, TypeVar

import httpx
import numpy as np
import numpy.typing as npt

from ..rest.models import Diagnostics

save_safetensors: Callable[..., bytes] | None
try:
    from safetensors.numpy import save as save_safetensors
except ModuleNotFoundError:  # the extra gramian[safetensors] is not installed
    save_safetensors = None

Array: TypeAlias = npt.NDArray[np.float64]
"""Numbers in float64, little-endian, row major."""

Integers: TypeAlias = npt.NDArray[np.int64]
"""Whole numbers of sparse matrices."""

Format: TypeAlias = Literal["safetensors", "json"]
"""Format of arrays in transit."""

T = TypeVar("T", bound=np.generic)

DTYPES = {"F64": "<f8", "I64": "<i8"}
"""Types of tensors in answers: F64 for numbers, I64 for the positions of entries of sparse matrices."""

JSON = "application/json"
SAFETENSORS = "application/x-safetensors"
PLY = "model/ply"


def available_format() -> Format:
    """Returns `"safetensors"` if that package is installed, else `"json"`."""
    return "json" if save_safetensors is None else "safetensors"


def encode(request: Mapping[str, object], format: Format) -> tuple[bytes, str]:  # noqa: A002
    """Returns the body of a request, a JSON document that contains arrays, and its media type.

    Raises
    ------
    ModuleNotFoundError
        If safetensors is requested and not installed.
    """
    if format == "safetensors" and save_safetensors is None:
        raise ModuleNotFoundError(
            "safetensors is not installed: pip install 'gramian[safetensors]'", name="safetensors"
        )
    tensors, fields = _split(request)
    # safetensors 0.4.3 cannot write a file without tensors.
    if format == "json" or save_safetensors is None or not tensors:
        return json.dumps(request, default=_plain, allow_nan=False).encode(), JSON
    return save_safetensors(tensors, metadata={"request": json.dumps(fields, allow_nan=False)}), SAFETENSORS


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{value!r} is not JSON")


def _split(request: Mapping[str, object], path: str = "") -> tuple[dict[str, Array], dict[str, object]]:
    """Splits a request into its arrays, by path, and all other fields."""
    tensors: dict[str, Array] = {}
    fields: dict[str, object] = {}
    for name, value in request.items():
        if isinstance(value, np.ndarray):
            tensors[path + name] = value
        elif isinstance(value, Mapping):
            inner, fields[name] = _split(value, f"{path}{name}.")
            tensors |= inner
        else:
            fields[name] = value
    return tensors, fields


@dataclass(frozen=True)
class Members:
    """The members of an answer, in either format."""

    tensors: Mapping[str, npt.NDArray[Any]]
    fields: Mapping[str, Any]
    request: Mapping[str, Any]
    """The request that was answered."""

    def __contains__(self, name: object) -> bool:
        return name in self.tensors or name in self.fields

    def __getitem__(self, name: str) -> Any:  # noqa: ANN401 (a tensor, or JSON)
        return self.tensors[name] if name in self.tensors else self.fields[name]

    @property
    def diagnostics(self) -> Diagnostics:
        """The diagnostics of the answer."""
        return Diagnostics.from_dict(self.fields["diagnostics"])

    def array(self, name: str) -> Array:
        """Returns an array, NaN where a number or a row is null."""
        if name in self.tensors:
            return self.tensors[name]
        return _frozen(np.array(_filled(self.fields[name], np.full(self._row(name), np.nan)), dtype=np.float64))

    def integers(self, name: str) -> Integers:
        """Returns a list of whole numbers."""
        if name in self.tensors:
            return self.tensors[name]
        return _frozen(np.array(self.fields[name], dtype=np.int64))

    def _row(self, name: str) -> tuple[int, ...]:
        """Returns the shape of what may be null in an array, since all of it may be."""
        if name in ("matrix", "matrices"):
            return (self.diagnostics.n_points,)
        if name in ("normals", "gradients", "gradient_std"):
            return (self.diagnostics.dimension,)
        if name in ("principal_curvatures", "principal_curvature_std"):
            return (self.diagnostics.dimension - 1,)
        if name == "principal_directions":
            return (self.diagnostics.dimension - 1, self.diagnostics.dimension)
        return ()


def decode(response: httpx.Response, request: Mapping[str, object]) -> Members:
    """Reads the answer to a request, in the format that it announces. Tensors are views of its bytes."""
    if not response.headers.get("Content-Type", "").startswith(SAFETENSORS):
        return Members({}, response.json(), request)
    body = response.content
    start = 8 + int.from_bytes(body[:8], "little")
    header = json.loads(body[8:start])
    fields = json.loads(header.pop("__metadata__")["response"])
    return Members({name: _view(body, start, tensor) for name, tensor in header.items()}, fields, request)


def _view(body: bytes, start: int, tensor: Mapping[str, Any]) -> npt.NDArray[Any]:
    shape: Sequence[int] = tensor["shape"]
    if tensor["dtype"] not in DTYPES:
        raise TypeError(f"the answer has a tensor of dtype {tensor['dtype']}, none of {', '.join(DTYPES)}")
    offset: int = tensor["data_offsets"][0]
    numbers = np.frombuffer(body, DTYPES[tensor["dtype"]], count=int(np.prod(shape)), offset=start + offset)
    return numbers.reshape(shape)


def _filled(rows: Sequence[Any], nothing: Array) -> list[Any]:
    """Returns the rows with `nothing` instead of null, also in matrices."""
    return [
        nothing if row is None else _filled(row, nothing) if isinstance(row, list) and None in row else row
        for row in rows
    ]


def _frozen(array: npt.NDArray[T]) -> npt.NDArray[T]:
    """Makes an array as read-only as the views of an answer's bytes are."""
    array.flags.writeable = False
    return array
