from enum import StrEnum


class SelectionParameter(StrEnum):
    ALPHA = "alpha"
    EPSILON = "epsilon"
    LENGTH_SCALE = "length_scale"
    LENGTH_SCALES = "length_scales"
    NU = "nu"
    VARIANCE = "variance"

    def __str__(self) -> str:
        return str(self.value)
