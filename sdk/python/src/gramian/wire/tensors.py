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

from ..rest.models import Degenerate, Diagnostics

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

    @property
    def diagnostics(self) -> Diagnostics:
        """The diagnostics of the answer."""
        return Diagnostics.from_dict(self.fields["diagnostics"])

    @property
    def degenerate(self) -> tuple[Degenerate, ...]:
        """The queries without a meaningful answer, or with a doubtful one."""
        return tuple(Degenerate.from_dict(entry) for entry in self.fields["degenerate"])

    def array(self, name: str, *entry: int) -> Array:
        """Returns an array with entries of the shape `entry`, NaN where an entry is null."""
        if name in self.tensors:
            return self.tensors[name]
        return _frozen(_filled(self.fields[name], entry))

    def arrays(self, name: str, *entry: int) -> Array:
        """Returns a list of arrays as one array, with entries of the shape `entry`, NaN for null."""
        if name in self.tensors:
            return self.tensors[name]
        return _frozen(np.stack([_filled(rows, entry) for rows in self.fields[name]]))

    def column(self, name: str, member: str) -> Array:
        """Returns a member of each object in a list, NaN where it is null."""
        return _frozen(_filled([entry.get(member) for entry in self.fields[name]], ()))

    def within(self, name: str) -> Members:
        """Returns the members of an object in the answer, which is JSON in every format."""
        return Members({}, self.fields[name], self.request)

    def integers(self, name: str) -> Integers:
        """Returns a list of whole numbers."""
        if name in self.tensors:
            return self.tensors[name]
        return _frozen(np.array(self.fields[name], dtype=np.int64))

    def optional(self, name: str, *entry: int) -> Array | None:
        """Returns an array, or None if the answer has no such member."""
        return self.array(name, *entry) if name in self.tensors or name in self.fields else None

    def optional_arrays(self, name: str, *entry: int) -> Array | None:
        """Returns a stack of arrays, or None if the answer has no such member."""
        return self.arrays(name, *entry) if name in self.tensors or name in self.fields else None


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


def _filled(rows: Sequence[Any], entry: tuple[int, ...]) -> Array:
    """Returns the rows as an array. `entry` is the shape of a row, since all rows may be null."""
    array = np.full((len(rows), *entry), np.nan)
    present = [row for row, numbers in enumerate(rows) if numbers is not None]
    if present:
        array[present] = [rows[row] for row in present]
    return array


def _frozen(array: npt.NDArray[T]) -> npt.NDArray[T]:
    """Makes an array as read-only as the views of an answer's bytes are."""
    array.flags.writeable = False
    return array
