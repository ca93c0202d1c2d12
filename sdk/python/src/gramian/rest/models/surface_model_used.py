from enum import StrEnum


class SurfaceModelUsed(StrEnum):
    OFFSET = "offset"
    REGRESSION = "regression"
    SIGNATURE = "signature"

    def __str__(self) -> str:
        return str(self.value)
