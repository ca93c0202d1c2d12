"""Displays of functions along a line: means with their bands and data, and likelihoods over α."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from ..wire.tensors import Array
from .axes import axes_of, labelled
from .quantities import default_quantity, std_of

BAND = 1.96
"""Half the width of a band, in standard deviations: 95 % of a normal law."""

MAX_LISTS = 10
"""Number of lists of values that are drawn."""

DEPTH = 30.0
"""How far below its maximum a criterion is shown. Models that are so much less likely do not matter."""


LIKELY = 0.5 * BAND**2
"""How far below its maximum a log likelihood is at the ends of an interval of 95 %."""


class PosteriorDisplay:
    """A function along a line, with its data, and with a band in which it is with 95 %.

    Parameters
    ----------
    places
        `[m]`. Where the queries are along the line.
    means
        `[m]` or `[m, k]`, V. The function, or several.
    std
        `[m]`, V. Standard deviations.
    samples
        `[count, m]`, V. Joint draws.
    data
        Places `[n]` and values `[n]` or `[n, k]` of the data.
    labels
        Names of the axes, with units.
    """

    def __init__(
        self,
        places: Array,
        means: Array,
        *,
        std: Array | None = None,
        samples: Array | None = None,
        data: tuple[Array, Array] | None = None,
        labels: tuple[str, str] = ("", ""),
    ) -> None:
        self.places = np.asarray(places, dtype=np.float64)
        self.means = means
        self.std = std
        self.samples = samples
        self.data = data
        self.labels = labels

    @classmethod
    def from_answer(
        cls,
        answer: Any,  # noqa: ANN401 (Interpolation, Posterior, …)
        quantity: str | None = None,
        places: Array | None = None,
        units: tuple[str, str] = ("L", "V"),
    ) -> Self:
        """Takes an answer at queries along a line: x, or else the length of the way from the first query to each.

        Raises
        ------
        ValueError
            If the positions are not known.
        """
        name = quantity or default_quantity(answer) or ""
        rows = answer.by_rows(name)
        on_line = places is None and answer.positions is not None and answer.positions.shape[1] == 1
        given = getattr(answer, "data", None) if on_line and name in ("values", "means") else None
        samples = getattr(answer, "samples", None) if name == "means" else None
        return cls(
            _places_of(answer, places),
            rows.reshape(len(rows), -1) if rows.ndim > 1 else rows,
            std=std_of(answer, name),
            samples=samples if samples is not None and samples.ndim == 2 else None,
            data=None if given is None else (given.points[:, 0], given.values.T),
            labels=(
                labelled("x" if on_line else "way along the queries", units[0]),
                labelled(name.replace("_", " "), answer.unit(name, *units)),
            ),
        )

    def plot(self, ax: Any = None, *, colour: str = "C0") -> Self:  # noqa: ANN401 (Axes)
        """Draws the function, its band, samples and data."""
        axes = axes_of(ax)
        order = np.argsort(self.places, kind="stable")
        places, means = self.places[order], self.means[order].reshape(len(order), -1)[:, :MAX_LISTS]
        colours = [colour, *(f"C{at}" for at in range(1, means.shape[1]))]
        for at, line_colour in enumerate(colours):
            label = {"label": self.labels[1].partition(",")[0] or "mean"} if at == 0 else {}
            if self.std is not None:
                reach = BAND * self.std[order]
                band = {"label": "95 %"} if at == 0 else {}
                low, high = means[:, at] - reach, means[:, at] + reach
                axes.fill_between(places, low, high, color=line_colour, alpha=0.25, linewidth=0, **band)
            (line,) = axes.plot(places, means[:, at], color=line_colour, **label)
            self.mappable_ = line
            self._draw_data(axes, at, line_colour)
        for sample in [] if self.samples is None else self.samples:
            axes.plot(places, sample[order], color=colour, alpha=0.4, linewidth=0.7)
        axes.set_xlabel(self.labels[0])
        axes.set_ylabel(self.labels[1])
        axes.legend()
        self.axes_, self.figure_ = axes, axes.figure
        return self

    def _draw_data(self, axes: Any, at: int, colour: str) -> None:  # noqa: ANN401 (Axes)
        if self.data is None:
            return
        places, values = self.data
        label = {"label": "data"} if at == 0 else {}
        shown = values.reshape(len(places), -1)[:, at]
        axes.plot(places, shown, ".", color="black" if at == 0 else colour, markersize=4, zorder=3, **label)


def _places_of(answer: Any, places: Array | None) -> Array:  # noqa: ANN401
    """Returns where the queries are along a line."""
    if places is not None:
        return np.asarray(places, dtype=np.float64)
    if answer.positions is None:
        raise ValueError("the positions are not known: give them, as plot(places=x)")
    if answer.positions.shape[1] == 1:
        x: Array = answer.positions[:, 0]
        return x
    steps = np.linalg.norm(np.diff(answer.positions, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


class LikelihoodDisplay:
    """The criterion of a model selection over the noise α, with what was selected.

    Parameters
    ----------
    alphas
        `[a]`, V².
    scores
        `[a]`. NaN where there is none.
    selected
        The selected α, if there is one.
    criterion
        Name of the criterion.
    """

    def __init__(
        self, alphas: Array, scores: Array, *, selected: float | None = None, criterion: str = "score"
    ) -> None:
        self.alphas = alphas
        self.scores = scores
        self.selected = selected
        self.criterion = criterion

    @classmethod
    def from_answer(cls, answer: Any) -> Self:  # noqa: ANN401 (ModelSelection)
        """Takes the path of a model selection."""
        path, name = answer.alpha_path, answer.criterion.value.replace("_", " ")
        # "generalized cross validation" is no likelihood, so it has no logarithm in its name.
        shown = f"log {name}" if name == "marginal likelihood" else name
        return cls(path.alphas, path.scores, selected=answer.alpha, criterion=shown)

    def plot(self, ax: Any = None, *, value_unit: str = "V") -> Self:  # noqa: ANN401 (Axes)
        """Draws the criterion over α on a logarithmic axis, down to 30 below its maximum.

        A dashed line bounds the values of α that explain the data nearly as well: an interval of about 95 %, if the
        criterion is a log marginal likelihood.
        """
        axes = axes_of(ax)
        (self.mappable_,) = axes.semilogx(self.alphas, self.scores, marker=".")
        self._focus(axes)
        if self.selected:
            noise = f"noise {np.sqrt(self.selected):.3g} {value_unit}"
            axes.axvline(self.selected, color="C1", label=f"selected: α = {self.selected:.3g}, {noise}")
        axes.set_xlabel(f"α, variance of the noise, {value_unit}²")
        axes.set_ylabel(self.criterion)
        axes.legend(loc="lower center")
        self.axes_, self.figure_ = axes, axes.figure
        return self

    def _focus(self, axes: Any) -> None:  # noqa: ANN401 (Axes)
        """Limits the axes to the values of α that are at most 30 below the maximum, and a decade beside them."""
        known = np.isfinite(self.scores)
        if not known.any():
            return
        best = float(self.scores[known].max())
        near = self.alphas[known & (np.nan_to_num(self.scores, nan=-np.inf) >= best - DEPTH)]
        axes.set_xlim(0.1 * near.min(), 10 * near.max())
        axes.set_ylim(max(float(self.scores[known].min()), best - DEPTH) - 0.1, best + 0.1 * DEPTH)
        axes.axhline(best - LIKELY, color="0.6", linewidth=0.8, linestyle="--", label=f"{LIKELY:.1f} below the best")
