from enum import StrEnum


class ValuesInclude(StrEnum):
    STD = "std"

    def __str__(self) -> str:
        return str(self.value)
