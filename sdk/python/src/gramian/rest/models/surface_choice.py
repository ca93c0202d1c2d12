from enum import StrEnum


class SurfaceChoice(StrEnum):
    AUTO = "auto"
    LOCAL = "local"
    OFFSET = "offset"
    SIGNATURE = "signature"

    def __str__(self) -> str:
        return str(self.value)
