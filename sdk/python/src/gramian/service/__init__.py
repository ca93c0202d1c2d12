"""Services that run on this machine: for a block (`local`), or for the whole interpreter (`cloud`)."""

from .local import local
from .shared import cloud, shared_client

__all__ = ["cloud", "local", "shared_client"]
