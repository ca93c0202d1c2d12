"""Draws docs/method.png: a cloud, its signature function, the level of the function, and its normals.

`python docs/gallery/method.py`, with the package of this repository and matplotlib.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import gramian

TARGET = Path(__file__).parents[1] / "method.png"
N_POINTS = 28
KERNEL, ALPHA = gramian.Kernel("matern", length_scale=1.5), 1e-6
TITLES = ["a cloud X", "its signature function u", "the level u = 1", "normals −∇u/|∇u|"]


def main() -> None:
    turn = np.linspace(0, 2 * np.pi, N_POINTS, endpoint=False)
    radius = 1 + 0.25 * np.cos(2 * turn) + 0.12 * np.sin(3 * turn)
    points = radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    axis = np.linspace(-1.75, 1.75, 141)
    x, y = np.meshgrid(axis, axis)
    cloud = gramian.cloud(points)
    levels = cloud.interpolate(np.ones(N_POINTS), np.column_stack([x.ravel(), y.ravel()]), kernel=KERNEL, alpha=ALPHA)
    u = levels.values.reshape(x.shape)
    normals = cloud.normals(kernel=KERNEL, alpha=ALPHA).normals

    figure, panels = plt.subplots(1, 4, figsize=(12, 3.4), layout="constrained")
    for step, (panel, title) in enumerate(zip(panels, TITLES, strict=True)):
        panel.set(title=title, aspect="equal", xlim=axis[[0, -1]], ylim=axis[[0, -1]], xticks=[], yticks=[])
        if step >= 1:
            panel.contourf(x, y, u, levels=np.linspace(u.min(), u.max(), 14), cmap="Greens", alpha=0.8)
        if step >= 2:  # noqa: PLR2004  # the third panel
            panel.contour(x, y, u, levels=[1], colors="#d62728", linewidths=2)
        if step == len(TITLES) - 1:
            panel.quiver(*points.T, *normals.T, color="#1f4e79", scale=9, width=0.008)
        panel.plot(*points.T, "o", color="black", markersize=4)
    figure.savefig(TARGET, dpi=110)


if __name__ == "__main__":
    main()
