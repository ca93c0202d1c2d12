from enum import StrEnum


class FactorizationUsed(StrEnum):
    BUNCH_KAUFMAN = "bunch_kaufman"
    CHOLESKY = "cholesky"
    CONJUGATE_GRADIENTS = "conjugate_gradients"
    LANDMARK = "landmark"
    LOCAL = "local"
    PARTIAL_PIVOTING_LU = "partial_pivoting_lu"
    PIVOTED_CHOLESKY = "pivoted_cholesky"

    def __str__(self) -> str:
        return str(self.value)
