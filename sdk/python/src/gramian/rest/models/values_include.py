from enum import StrEnum


class ValuesInclude(StrEnum):
    DEVIATIONS = "std"

    def __str__(self) -> str:
        return str(self.value)
