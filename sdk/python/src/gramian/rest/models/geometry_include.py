from enum import StrEnum


class GeometryInclude(StrEnum):
    DEVIATIONS = "std"
    EDGE_NORMALS = "edge_normals"

    def __str__(self) -> str:
        return str(self.value)
