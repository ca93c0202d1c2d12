from enum import StrEnum


class MeshQuality(StrEnum):
    RAW = "raw"
    REGULAR = "regular"

    def __str__(self) -> str:
        return str(self.value)
