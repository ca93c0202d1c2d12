from enum import StrEnum


class VertexSupport(StrEnum):
    BRIDGED = "bridged"
    EXTRAPOLATED = "extrapolated"
    OBSERVED = "observed"

    def __str__(self) -> str:
        return str(self.value)
