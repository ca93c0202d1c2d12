from enum import StrEnum


class MeshInclude(StrEnum):
    CURVATURES = "curvatures"
    STD = "std"

    def __str__(self) -> str:
        return str(self.value)
