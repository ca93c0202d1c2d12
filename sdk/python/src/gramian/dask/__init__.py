"""Clouds beyond one machine, in tiles, on Dask: the extra `gramian[dask]`.

>>> import gramian.dask
>>> angles = np.arange(2000) * np.pi / 1000
>>> points = np.column_stack([2 * np.cos(angles), np.sin(angles)])  # an ellipse, [n, d]; NumPy's or Dask's
>>> tiles = gramian.dask.connect().tiles(points, n_tiles=2)  # connect([…]): the addresses of the replicas
>>> curvatures = tiles.curvatures()  # Dask arrays: nothing is computed yet
>>> curvatures.mean_curvatures[0].compute().round(1)  # 2 at the tip: axis/(other axis)²
np.float64(2.0)

A cloud is cut into cells with equally many points, by halving across the widest side. A tile is a cell with its halo,
the nearest neighbours of its points beyond its sides, and with what the service learns from the cloud as a whole, so
that answers are those of one request for all points. Which side is outward one coarse cloud says for all tiles.
"""

from ..tiles.replicas import Replicas
from .answers import Curvatures, Interpolation, Normals, SparseOperator
from .service import Service, connect
from .tiles import Tiles

__all__ = [
    "Curvatures",
    "Interpolation",
    "Normals",
    "Replicas",
    "Service",
    "SparseOperator",
    "Tiles",
    "connect",
]
