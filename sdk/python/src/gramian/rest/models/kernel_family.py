from enum import StrEnum


class KernelFamily(StrEnum):
    GAUSS = "gauss"
    INVERSE_MULTIQUADRIC = "inverse_multiquadric"
    LAPLACE = "laplace"
    MATERN = "matern"
    WENDLAND = "wendland"

    def __str__(self) -> str:
        return str(self.value)
