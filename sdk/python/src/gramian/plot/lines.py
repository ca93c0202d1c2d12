"""Displays of functions along a line: posteriors with their bands, and likelihoods over α."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from ..wire.tensors import Array
from .needed import needed

BAND = 1.96
"""Half the width of a band, in standard deviations: 95 % of a normal law."""


class PosteriorDisplay:
    """The mean of a Gaussian process along a line, with a band in which the function is with 95 %.

    Parameters
    ----------
    places
        `[m]`. Where the queries are along the line.
    means
        `[m]`, V.
    std
        `[m]`, V. Standard deviations.
    samples
        `[count, m]`, V. Joint draws.
    """

    def __init__(self, places: Array, means: Array, *, std: Array | None = None, samples: Array | None = None) -> None:
        self.places = np.asarray(places, dtype=np.float64)
        self.means = means
        self.std = std
        self.samples = samples

    @classmethod
    def from_answer(cls, answer: Any, places: Array | None = None) -> Self:  # noqa: ANN401 (Posterior)
        """Takes a posterior at queries along a line, by the length of the way from the first to each.

        Raises
        ------
        ValueError
            If the positions are not known.
        """
        if places is None:
            if answer.positions is None:
                raise ValueError("the positions are not known: give them, as plot(places=x)")
            steps = np.linalg.norm(np.diff(answer.positions, axis=0), axis=1)
            places = np.concatenate([[0.0], np.cumsum(steps)])
            if answer.positions.shape[1] == 1:
                places = answer.positions[:, 0]
        std = None if answer.variances is None else np.sqrt(answer.variances)
        return cls(places, answer.means, std=std, samples=answer.samples)

    def plot(self, ax: Any = None, *, colour: str = "C0") -> Self:  # noqa: ANN401 (Axes)
        """Draws mean, band and samples."""
        axes = needed("matplotlib.pyplot", "plot").subplots()[1] if ax is None else ax
        order = np.argsort(self.places, kind="stable")
        places = self.places[order]
        if self.std is not None:
            low, high = (self.means + sign * BAND * self.std for sign in (-1, 1))
            axes.fill_between(places, low[order], high[order], color=colour, alpha=0.25, linewidth=0, label="95 %")
        for sample in [] if self.samples is None else self.samples:
            axes.plot(places, sample[order], color=colour, alpha=0.4, linewidth=0.7)
        (self.mappable_,) = axes.plot(places, self.means[order], color=colour, label="mean")
        axes.legend()
        self.axes_, self.figure_ = axes, axes.figure
        return self


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
    """

    def __init__(self, alphas: Array, scores: Array, *, selected: float | None = None) -> None:
        self.alphas = alphas
        self.scores = scores
        self.selected = selected

    @classmethod
    def from_answer(cls, answer: Any) -> Self:  # noqa: ANN401 (ModelSelection)
        """Takes the path of a model selection."""
        return cls(answer.alpha_path.alphas, answer.alpha_path.scores, selected=answer.alpha)

    def plot(self, ax: Any = None) -> Self:  # noqa: ANN401 (Axes)
        """Draws the criterion over α on a logarithmic axis."""
        axes = needed("matplotlib.pyplot", "plot").subplots()[1] if ax is None else ax
        (self.mappable_,) = axes.semilogx(self.alphas, self.scores, marker=".")
        if self.selected:
            axes.axvline(self.selected, color="C1", label=f"selected: {self.selected:.3g}")
            axes.legend()
        axes.set_xlabel("α, V²")
        axes.set_ylabel("score")
        self.axes_, self.figure_ = axes, axes.figure
        return self
