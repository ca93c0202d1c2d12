from enum import IntEnum


class Smoothness(IntEnum):
    C2 = 2
    C4 = 4
    C6 = 6

    def __str__(self) -> str:
        return str(self.value)
