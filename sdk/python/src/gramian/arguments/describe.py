"""`repr` of answers and options: arrays by their shape, absent members left out."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Any, cast

import numpy as np

from ..rest.types import Unset

MAX_SHOWN = 3
"""Number of entries shown of a tuple. Longer tuples are shown by their first entries and their length."""


def described(kind: str, members: Mapping[str, object]) -> str:
    """Returns the `repr` of an object with these members."""
    present = {name: value for name, value in members.items() if not (value is None or isinstance(value, Unset))}
    return f"{kind}({', '.join(f'{name}={in_words(value)}' for name, value in present.items())})"


def in_words(value: object) -> str:
    """Returns the `repr` of a member.

    >>> from gramian.arguments.describe import in_words
    >>> in_words(np.zeros((8, 2))), in_words(gramian.KernelFamily.GAUSS), in_words(("signature",) * 8)
    ('array[8, 2]', "'gauss'", "('signature', 'signature', 'signature', … 8 entries)")
    """
    if isinstance(value, np.ndarray):
        return f"array{list(value.shape)}"
    if hasattr(value, "tocsr"):  # of SciPy, which may not be installed
        return f"{type(value).__name__}{list(cast(Any, value).shape)}"
    if isinstance(value, Enum):
        return repr(value.value)
    if isinstance(value, tuple) and all(isinstance(entry, float) for entry in value):
        return repr(value)  # length scales, which are few
    if isinstance(value, tuple | list):
        shown = [in_words(entry) for entry in value[:MAX_SHOWN]]
        left_out = [f"… {len(value)} entries"] if len(value) > MAX_SHOWN else []
        return f"({', '.join(shown + left_out)})"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name!r}: {in_words(entry)}" for name, entry in value.items()) + "}"
    return repr(value)
