from enum import StrEnum


class SurfaceUsed(StrEnum):
    OFFSET = "offset"
    SIGNATURE = "signature"

    def __str__(self) -> str:
        return str(self.value)
