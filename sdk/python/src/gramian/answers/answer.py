"""The base class of all answers."""

from __future__ import annotations

from ..arguments.describe import described


class Answer:
    """The base class of all answers. `repr` shows arrays by their shapes, and leaves out absent members."""

    def __repr__(self) -> str:
        # `fit` is left out, because it repeats the diagnostics and the request.
        members = {name: value for name, value in vars(self).items() if name != "fit"}
        return described(type(self).__name__, members)
