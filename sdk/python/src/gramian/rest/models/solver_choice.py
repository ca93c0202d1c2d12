from enum import StrEnum


class SolverChoice(StrEnum):
    AUTO = "auto"
    DENSE = "dense"
    ITERATIVE = "iterative"
    LANDMARK = "landmark"
    LOCAL = "local"

    def __str__(self) -> str:
        return str(self.value)
