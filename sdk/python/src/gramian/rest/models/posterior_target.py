from enum import StrEnum


class PosteriorTarget(StrEnum):
    FUNCTION = "function"
    OBSERVATION = "observation"

    def __str__(self) -> str:
        return str(self.value)
