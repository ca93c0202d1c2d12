from enum import StrEnum


class FactorizationUsed(StrEnum):
    CHOLESKY = "cholesky"
    CONJUGATE_GRADIENTS = "conjugate_gradients"
    LANDMARK = "landmark"
    LOCAL = "local"
    PIVOTED_CHOLESKY = "pivoted_cholesky"

    def __str__(self) -> str:
        return str(self.value)
