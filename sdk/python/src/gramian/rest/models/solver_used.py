from enum import StrEnum


class SolverUsed(StrEnum):
    DENSE = "dense"
    ITERATIVE = "iterative"
    LANDMARK = "landmark"
    LOCAL = "local"

    def __str__(self) -> str:
        return str(self.value)
