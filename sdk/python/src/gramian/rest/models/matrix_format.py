from enum import StrEnum


class MatrixFormat(StrEnum):
    DENSE = "dense"

    def __str__(self) -> str:
        return str(self.value)
