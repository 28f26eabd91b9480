"""A file with y up, read with z up and with y up: the room lies on its side, or stands."""

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import bisplat
from scenes.importing.up_axis import Y_UP_TO_Z_UP

x, y, z = np.diag([6.0, 2.8, -5.0])  # as in the file: 2.8 m along y is the height
parts = {
    "Floor": bisplat.shapes.sheet(0 * x, x, z),
    "Ceiling": bisplat.shapes.sheet(y, x, z),
    "Wall N": bisplat.shapes.sheet(z, x, y),
    "Wall W": bisplat.shapes.sheet(0 * x, z, y),
}
colors = {"Floor": "tab:brown", "Ceiling": "tab:gray", "Wall N": "tab:blue", "Wall W": "tab:cyan"}

figure = plt.figure(figsize=(8, 3.4), layout="none")
for column, (turn, title) in enumerate(
    ((np.eye(4), "--up z: Floor and Ceiling stand upright"), (Y_UP_TO_Z_UP, "--up y: they are level"))
):
    axis = figure.add_axes((0.5 * column, 0, 0.5, 0.92), projection="3d")
    for name, mesh in parts.items():
        corners = mesh.copy().apply_transform(turn).triangles
        axis.add_collection3d(Poly3DCollection(corners, color=colors[name], alpha=0.55, edgecolor="none"))
        axis.text(*corners.mean(axis=(0, 1)), name, ha="center", fontsize=8)
    box = (np.array([[0, 0, -5], [6, 2.8, 0]]) @ turn[:3, :3].T).T
    axis.set(
        xlim=sorted(box[0]), ylim=sorted(box[1]), zlim=sorted(box[2]), xlabel="x (m)", ylabel="y (m)", zlabel="z (m)"
    )
    axis.locator_params(nbins=3)
    axis.set_box_aspect(np.ptp(box, axis=1), zoom=0.85)
    axis.view_init(elev=20, azim=-60)
    axis.set_title(title, fontsize=9)
