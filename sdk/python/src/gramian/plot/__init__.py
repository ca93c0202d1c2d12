"""Pictures of answers, by matplotlib (the extra `gramian[plot]`).

`answer.plot()` draws an answer. The displays here draw what they are given, in the manner of scikit-learn: what
is shown goes to the constructor, how it looks to `plot()`, and `figure_`, `axes_` and `mappable_` are what
was drawn.

>>> import gramian, numpy as np
>>> from gramian.plot import SurfaceDisplay
>>> angles = np.arange(64) * np.pi / 32
>>> circle = gramian.Client().cloud(np.column_stack([2 * np.cos(angles), np.sin(angles)]))
>>> display = SurfaceDisplay.from_answer(circle.curvatures(std=True)).plot()
>>> display.axes_.get_title()
'mean curvatures'
"""

from .lines import LikelihoodDisplay, PosteriorDisplay
from .matrices import MatrixDisplay
from .surfaces import LevelSetDisplay, SurfaceDisplay

__all__ = ["LevelSetDisplay", "LikelihoodDisplay", "MatrixDisplay", "PosteriorDisplay", "SurfaceDisplay"]
