"""Packages that pictures need, imported when something is drawn."""

from __future__ import annotations

import importlib
from typing import Any


def needed(module: str, extra: str) -> Any:  # noqa: ANN401 (a module)
    """Imports a module.

    Raises
    ------
    ModuleNotFoundError
        If its package is not installed, with the extra that installs it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        message = f"{package} is not installed: pip install 'gramian[{extra}]'"
        raise ModuleNotFoundError(message, name=package) from error
