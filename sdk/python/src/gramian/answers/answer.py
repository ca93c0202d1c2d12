"""What all answers have in common."""

from __future__ import annotations

from ..arguments.describe import described


class Answer:
    """What all answers have in common: they show arrays by their shapes, and leave out what is absent."""

    def __repr__(self) -> str:
        # The fit repeats the diagnostics and the request.
        members = {name: value for name, value in vars(self).items() if name != "fit"}
        return described(type(self).__name__, members)
