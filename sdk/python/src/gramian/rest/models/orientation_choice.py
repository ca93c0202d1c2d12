from enum import StrEnum


class OrientationChoice(StrEnum):
    GRADIENT = "gradient"
    OUTWARD = "outward"

    def __str__(self) -> str:
        return str(self.value)
