"""Members of answers that are there only if the request asks for them."""

from __future__ import annotations

from typing import Any


class Asked:
    """A member that raises `AttributeError` if the answer lacks it, with the argument that asks for it.

    So its type is that of an array, not of an array or None. `hasattr(answer, name)` is true if it is there.
    """

    def __init__(self, how: str) -> None:
        """Takes the argument that asks for the member, as it is written in a call."""
        self.how = how
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: object, owner: type) -> object:
        if instance is None:
            return None  # the default of the field
        if self.name not in vars(instance):
            raise AttributeError(f"this answer has no {self.name}: {self.how} in the call asks for it")
        return vars(instance)[self.name]

    def __set__(self, instance: object, value: object) -> None:
        if value is not None:
            vars(instance)[self.name] = value


def asked(how: str) -> Any:  # noqa: ANN401 (of the type of the member)
    """Declares a member of an answer that `how` asks for, as in `variances: Array = asked('include="variances"')`."""
    return Asked(how)
