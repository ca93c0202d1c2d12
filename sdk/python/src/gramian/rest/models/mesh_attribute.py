from enum import StrEnum


class MeshAttribute(StrEnum):
    CURVATURES = "curvatures"
    STD = "std"

    def __str__(self) -> str:
        return str(self.value)
