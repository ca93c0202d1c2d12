from enum import StrEnum


class DuplicatePolicy(StrEnum):
    MERGE = "merge"
    REFUSE = "refuse"

    def __str__(self) -> str:
        return str(self.value)
