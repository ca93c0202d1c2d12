"""What a clone has of the generated client, of which git ignores a part."""

from __future__ import annotations

import ast
import subprocess
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "src" / "gramian"
MODELS = PACKAGE / "rest" / "models"


def imports(path: Path) -> Iterator[tuple[Path, str]]:
    """Yields the module and the name of each relative import, in functions too."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            module = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            yield from ((module, alias.name) for alias in node.names)


def names_of_models(path: Path) -> Iterator[str]:
    """Yields the names of models that a file imports, or finds in `models`."""
    yield from (name for module, name in imports(path) if module == MODELS)
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "models":
            yield node.attr


def test_a_clone_has_every_module_that_it_imports() -> None:
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.py"]
    listed = subprocess.run(command, cwd=PACKAGE, capture_output=True, text=True, check=True).stdout.split()
    files = {PACKAGE / name for name in listed}
    front = MODELS / "__init__.py"
    home = {name: module for module, name in imports(front)}
    needed = {home[name] for path in files for name in names_of_models(path)}
    assert len(needed) > 30
    # The front of the models imports each when it is first used.
    needed |= {module for path in files - {front} for module, _ in imports(path)}
    missing = [module for module in needed if not {module.with_suffix(".py"), module / "__init__.py"} & files]
    assert not missing
