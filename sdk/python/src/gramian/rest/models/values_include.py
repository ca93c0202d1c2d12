from enum import StrEnum


class ValuesInclude(StrEnum):
    DEVIATIONS = "deviations"

    def __str__(self) -> str:
        return str(self.value)
