from enum import StrEnum


class MeshInclude(StrEnum):
    CURVATURES = "curvatures"
    DEVIATIONS = "deviations"

    def __str__(self) -> str:
        return str(self.value)
