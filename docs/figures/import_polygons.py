"""A wall with a doorway as one polygon: a fan of triangles covers the doorway, ear clipping leaves it open."""

import mapbox_earcut
import matplotlib.pyplot as plt
import numpy as np

wall = np.array([[0, 2.1], [0, 0], [0.3, 0], [0.3, 1.7], [1.1, 1.7], [1.1, 0], [4, 0], [4, 2.5], [0, 2.5]])
count = len(wall)
fan = np.array([[0, k, k + 1] for k in range(1, count - 1)])
ears = mapbox_earcut.triangulate_float64(wall, np.array([count])).reshape(-1, 3)

figure, axes = plt.subplots(1, 3, figsize=(8, 2.2), layout="constrained")
axes[0].fill(*wall.T, color="tab:blue", alpha=0.4)
for axis, triangles, color in ((axes[1], fan, "tab:red"), (axes[2], ears, "tab:green")):
    for corners in wall[triangles]:
        axis.fill(*corners.T, facecolor=color, edgecolor=color, alpha=0.35)
for axis, title in zip(axes, ("the polygon in the file", "as a fan: wrong", "cut by ear clipping"), strict=True):
    axis.plot(*np.vstack([wall, wall[:1]]).T, color="black", lw=1)
    axis.set(aspect="equal", title=title)
    axis.set_axis_off()
