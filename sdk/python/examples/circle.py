import numpy as np

import gramian

angles = np.arange(8) * np.pi / 4
cloud = gramian.Client().cloud(np.column_stack([np.cos(angles), np.sin(angles)]))
print(cloud.curvatures().mean_curvatures)
