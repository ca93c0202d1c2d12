from enum import StrEnum


class MeanChoice(StrEnum):
    CONSTANT = "constant"
    LINEAR = "linear"
    ZERO = "zero"

    def __str__(self) -> str:
        return str(self.value)
