from enum import StrEnum


class ValueAttribute(StrEnum):
    STD = "std"

    def __str__(self) -> str:
        return str(self.value)
