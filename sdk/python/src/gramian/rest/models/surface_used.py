from enum import StrEnum


class SurfaceUsed(StrEnum):
    LOCAL = "local"
    OFFSET = "offset"
    SIGNATURE = "signature"

    def __str__(self) -> str:
        return str(self.value)
