"""The numbers of an answer by rows: positions, cells between them, and the arrays that have a row for each."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ..plot.quantities import default_quantity, scalars_of, std_of
from ..wire.tensors import Array, Integers
from .colours import colours_of
from .quantities import quantities_of

AXES = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")

PLACES = ("positions", "vertices")
"""Members that are positions themselves."""


@dataclass(frozen=True)
class Table:
    """Rows of numbers.

    Attributes
    ----------
    n_rows
        Number of rows, m.
    positions
        `[m, d]`. None if they are not known.
    cells
        `[l, 2]` or `[l, 3]`: the rows that segments or triangles connect.
    arrays
        Arrays `[m, …]`, by the names of the answer's members.
    words
        A word for each row, by name: `support`, `surface_models`.
    codes_of_words
        The words that there are, by name, in the order of their codes.
    flags
        `[m]` for each reason that occurs: 1 where a row is flagged with it.
    quantity
        Name of the quantity that `scalars` and `colours` show. None if there is none.
    scalars
        `[m]`.
    colours
        `[m, 3]`, uint8.
    """

    n_rows: int
    positions: Array | None
    cells: Integers | None
    arrays: dict[str, Array]
    words: dict[str, npt.NDArray[np.str_]]
    codes_of_words: dict[str, tuple[str, ...]]
    flags: dict[str, npt.NDArray[np.uint8]]
    quantity: str | None = None
    scalars: Array | None = None
    colours: npt.NDArray[np.uint8] | None = field(default=None, repr=False)

    def columns(self) -> dict[str, Array]:
        """Returns positions, normals and all other components of arrays as columns `[m]`, with singular names."""
        found: dict[str, Array] = {}
        if self.positions is not None:
            found |= _components(self.positions, AXES, "x")
        if "normals" in self.arrays:
            found |= _components(self.arrays["normals"], NORMAL, "normal")
        for name, array in self.arrays.items():
            if name != "normals":
                found |= _components(array, (), singular(name))
        return found

    def vectors(self) -> dict[str, npt.NDArray[Any]]:
        """Returns arrays `[m]` or `[m, c]` by the names of the answer's members, codes and colours.

        Vectors of the plane have a third component 0.
        """
        found: dict[str, npt.NDArray[Any]] = {}
        for name, array in self.arrays.items():
            flat = array.reshape(self.n_rows, -1) if array.ndim > 1 else array
            is_vector = name in ("normals", "gradients", "gradient_std") and flat.shape[-1] == 2
            found[name] = np.column_stack([flat, np.zeros(self.n_rows)]) if is_vector else flat
        colours = {} if self.colours is None else {"colours": self.colours}
        return found | self.codes() | colours

    def texts(self) -> dict[str, npt.NDArray[np.str_]]:
        """Returns words, and the reasons of flags of each row, separated by blanks."""
        reasons: list[list[str]] = [[] for _ in range(self.n_rows)]
        for reason, is_flagged in self.flags.items():
            for row in np.flatnonzero(is_flagged):
                reasons[row].append(reason)
        words = {singular(name): each for name, each in self.words.items()}
        return words | {"flags": np.array([" ".join(each) for each in reasons], dtype=np.str_)}

    def codes(self) -> dict[str, npt.NDArray[np.uint8]]:
        """Returns words as their codes, and a column `flag_…` of 0 and 1 for each reason of flags that occurs."""
        found = {}
        for name, words in self.words.items():
            code = {word: at for at, word in enumerate(self.codes_of_words[name])}
            found[singular(name)] = np.array([code[word] for word in words], dtype=np.uint8)
        return found | {f"flag_{reason}": is_flagged for reason, is_flagged in self.flags.items()}

    def legend(self) -> list[str]:
        """Returns lines that explain the codes, the flags and the colours."""
        lines = [f"quality and colours: {self.quantity}"] if self.quantity else []
        for name, words in self.codes_of_words.items():
            lines.append(f"{singular(name)}: {', '.join(f'{at} {word}' for at, word in enumerate(words))}")
        return lines + [f"flag_{reason}: 1 where the number is in doubt" for reason in self.flags]

    def in_space(self, ending: str) -> Array:
        """Returns the positions `[m, 3]`, with zeros for the coordinates that they do not have.

        Raises
        ------
        ValueError
            If the positions are not known, or have more than three coordinates.
        """
        if self.positions is None:
            raise ValueError("the positions are not known: give them, as positions=points")
        n, d = self.positions.shape
        if d > 3:
            raise ValueError(f"{ending} has three coordinates, and the positions have {d}: save them as .csv or .npz")
        return np.column_stack([self.positions, np.zeros((n, 3 - d))])


def table_of(answer: Any, positions: Any = None, quantity: str | None = None) -> Table:  # noqa: ANN401 (an Answer)
    """Returns the numbers of an answer by rows.

    Parameters
    ----------
    answer
        An answer.
    positions : array_like, `[m, d]`, optional
        The queries, if the client has no copy of them.
    quantity : str, optional
        Name of the member that colours show. That of `answer.plot()` if absent.
    """
    arrays, words = _by_rows(answer)
    places = next((getattr(answer, name) for name in ("vertices", "positions") if hasattr(answer, name)), None)
    if positions is not None:
        places = np.asarray(positions, dtype=np.float64)
    known = [*arrays.values(), *words.values(), *([] if places is None else [places])]
    n_rows = len(known[0]) if known else answer.diagnostics.n_queries
    if any(len(each) != n_rows for each in known):
        raise ValueError(f"positions must have {n_rows} rows, one for each query, not {len(known[-1])}")
    table = Table(n_rows, places, getattr(answer, "cells", None), arrays, words, answer.WORDS, _flags(answer, n_rows))
    shown = quantity or default_quantity(answer)
    return table if shown is None else _coloured(table, answer, shown)


def _by_rows(answer: Any) -> tuple[dict[str, Array], dict[str, npt.NDArray[np.str_]]]:  # noqa: ANN401
    """Returns the arrays and the words of an answer that have a row for each of its positions."""
    # Matrices have an axis of points beside that of queries.
    names = [
        name
        for name, quantity in quantities_of(type(answer)).items()
        if [axis for axis in quantity.axes if axis in ("n", answer.ROWS)] == [answer.ROWS]
    ]
    present = [name for name in names if isinstance(getattr(answer, name, None), np.ndarray) and name not in PLACES]
    words = {name: np.array(getattr(answer, name), dtype=np.str_) for name in answer.WORDS}
    return {name: answer.by_rows(name) for name in present}, words


def _flags(answer: Any, n_rows: int) -> dict[str, npt.NDArray[np.uint8]]:  # noqa: ANN401
    found: dict[str, npt.NDArray[np.uint8]] = defaultdict(lambda: np.zeros(n_rows, dtype=np.uint8))
    for flag in getattr(answer, "flags", ()):
        found[flag.reason.value][flag.query] = 1
    return dict(sorted(found.items()))


def _coloured(table: Table, answer: Any, quantity: str) -> Table:  # noqa: ANN401
    scalars = scalars_of(answer, quantity)
    colours = colours_of(scalars, std_of(answer, quantity), quantity)
    return Table(**{**vars(table), "quantity": quantity, "scalars": scalars, "colours": colours})


def _components(array: Array, names: tuple[str, ...], stem: str) -> dict[str, Array]:
    """Returns the components of an array `[m, …]` by name."""
    if array.ndim == 1:
        return {stem: array}
    if names and array.shape[1] <= len(names):
        return dict(zip(names, array.T, strict=False))
    return {"_".join([stem, *map(str, at)]): array[(slice(None), *at)] for at in np.ndindex(array.shape[1:])}


def singular(name: str) -> str:
    """Returns the name of one number: `mean_curvature` of `mean_curvatures`."""
    return f"{name[:-3]}y" if name.endswith("ies") else name.removesuffix("s")
