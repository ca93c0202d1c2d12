"""Files of answers, which appear whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from uuid import uuid4


def replace_file(path: str | os.PathLike[str], content: bytes) -> None:
    """Writes beside a file, then replaces the file in one step.

    So a full disk or an interrupt leaves an older file as it was. Its permissions and links to it are kept.
    Pipes and devices are written directly.
    """
    target = Path(path).resolve()
    if target.exists() and not target.is_file():
        target.write_bytes(content)
        return
    beside = target.with_name(f".{target.name}.{uuid4().hex}")
    try:
        with beside.open("xb") as file:
            if target.exists():
                beside.chmod(target.stat().st_mode)
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)
