"""The gateway's frame: the array in the x-y plane, boresight, azimuth and elevation of a direction."""

import matplotlib.pyplot as plt
import numpy as np

import bisplat

azimuth, elevation = np.radians(115), np.radians(38)
elements = bisplat.PlanarArray().positions / 1.5  # drawn smaller than the arrow
along = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
u = np.cos(elevation) * along + np.sin(elevation) * np.array([0, 0, 1])

figure = plt.figure(figsize=(6.4, 4.2), layout="none")  # constrained layout knows nothing of 3D axes
axis = figure.add_axes((-0.2, -0.13, 1.4, 1.3), projection="3d")
axis.view_init(elev=22, azim=30)
axis.set_axis_off()
axis.set(xlim=(-0.8, 1.2), ylim=(-0.8, 1.2), zlim=(0, 1.2))
axis.set_box_aspect((2, 2, 1.2), zoom=1.2)

square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * 0.62
axis.plot(*square.T, 0, color="0.75", lw=1)
axis.scatter(*elements.T, color="tab:blue", s=26, depthshade=False, label="elements")
for vector, name in (((1.15, 0, 0), "x"), ((0, 1.15, 0), "y"), ((0, 0, 1.15), "z: boresight, θ = 90°")):
    axis.quiver(0, 0, 0, *vector, color="black", lw=1.2, arrow_length_ratio=0.07)
    axis.text(*(1.12 * np.array(vector)), name, ha="center")
axis.quiver(0, 0, 0, *(1.1 * u), color="tab:red", lw=2, arrow_length_ratio=0.08)
axis.text(*(1.2 * u), "u(φ, θ)", color="tab:red", ha="left")
axis.plot(*np.outer(1.1 * np.array([0, np.cos(elevation)]), along).T, color="tab:red", lw=1, ls=":")
axis.plot(*np.stack([1.1 * np.cos(elevation) * along, 1.1 * u]).T, color="tab:red", lw=1, ls=":")

turn = np.linspace(0, azimuth, 40)
axis.plot(0.5 * np.cos(turn), 0.5 * np.sin(turn), 0, color="tab:green", lw=2)
axis.text(*(0.62 * np.array([np.cos(azimuth / 2), np.sin(azimuth / 2), 0])), "φ", color="tab:green", fontsize=13)
rise = np.linspace(0, elevation, 40)[:, None]
axis.plot(*(0.62 * (np.cos(rise) * along + np.sin(rise) * np.array([0, 0, 1]))).T, color="tab:orange", lw=2)
middle = np.cos(elevation / 2) * along + np.sin(elevation / 2) * np.array([0, 0, 1])
axis.text(*(0.7 * middle), "θ", color="tab:orange", fontsize=13)
