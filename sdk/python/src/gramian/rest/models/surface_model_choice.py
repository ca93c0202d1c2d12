from enum import StrEnum


class SurfaceModelChoice(StrEnum):
    AUTO = "auto"
    OFFSET = "offset"
    REGRESSION = "regression"
    SIGNATURE = "signature"

    def __str__(self) -> str:
        return str(self.value)
