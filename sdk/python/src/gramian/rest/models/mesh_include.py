from enum import StrEnum


class MeshInclude(StrEnum):
    CURVATURES = "curvatures"
    DEVIATIONS = "std"

    def __str__(self) -> str:
        return str(self.value)
