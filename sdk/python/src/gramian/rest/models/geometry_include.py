from enum import StrEnum


class GeometryInclude(StrEnum):
    DEVIATIONS = "deviations"

    def __str__(self) -> str:
        return str(self.value)
