from enum import StrEnum


class GeometryAttribute(StrEnum):
    EDGE_NORMALS = "edge_normals"
    STD = "std"

    def __str__(self) -> str:
        return str(self.value)
