from enum import StrEnum


class SelectionCriterion(StrEnum):
    GENERALIZED_CROSS_VALIDATION = "generalized_cross_validation"
    LEAVE_ONE_OUT = "leave_one_out"
    MARGINAL_LIKELIHOOD = "marginal_likelihood"

    def __str__(self) -> str:
        return str(self.value)
