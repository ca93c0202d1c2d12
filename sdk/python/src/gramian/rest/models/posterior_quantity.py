from enum import StrEnum


class PosteriorQuantity(StrEnum):
    COVARIANCE = "covariance"
    GRADIENTS = "gradients"
    GRADIENT_VARIANCES = "gradient_variances"
    LOG_MARGINAL_LIKELIHOOD = "log_marginal_likelihood"
    OBSERVATION_VARIANCES = "observation_variances"
    VARIANCES = "variances"

    def __str__(self) -> str:
        return str(self.value)
