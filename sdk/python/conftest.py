from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
import pytest

import gramian
from gramian.wire.tensors import Array


@pytest.fixture(autouse=True)
def _names_of_doctests(doctest_namespace: dict[str, object]) -> None:
    doctest_namespace.update(gramian=gramian, np=np)


@pytest.fixture(autouse=True)
def _figures() -> Iterator[None]:
    """Closes the figures of a test. pyplot keeps them otherwise, and warns when there are many."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def client() -> Iterator[gramian.Client]:
    """A client of the server under test, at GRAMIAN_URL."""
    with gramian.Client() as client:
        yield client


@pytest.fixture
def circle() -> Array:
    """Eight points of the unit circle."""
    angles = np.arange(8) * np.pi / 4
    return np.column_stack([np.cos(angles), np.sin(angles)])
