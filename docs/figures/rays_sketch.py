"""Three ideas of the ray tracer: the image of a source, the slab behind a surface, diffraction at an edge."""

import matplotlib.pyplot as plt
import numpy as np

figure, (image, slab, edge) = plt.subplots(1, 3, figsize=(8, 3.1), layout="constrained")
blue, red = {"color": "tab:blue", "lw": 1.6}, {"color": "tab:red", "lw": 1.6}

# Gateway and transmitter over a wall at y = 0: the image of the gateway lies below.
gateway, transmitter = np.array([0.0, 1.0]), np.array([2.6, 1.6])
mirrored = gateway * (1, -1)
share = -mirrored[1] / (transmitter - mirrored)[1]
point = mirrored + share * (transmitter - mirrored)
image.axhline(0, color="0.3", lw=3)
image.plot(*np.stack([gateway, transmitter]).T, **blue)
image.plot(*np.stack([gateway, point, transmitter]).T, **red)
image.plot(*np.stack([mirrored, point]).T, **red, ls=":")
for place, name, mark, side in (
    (gateway, "element", "s", (-12, 7)),
    (mirrored, "its image", "s", (-4, -14)),
    (transmitter, "transmitter", "o", (-36, 7)),
    (point, "reflection", ".", (5, 4)),
):
    image.plot(*place, mark, color="black", mfc="white" if name == "its image" else "black")
    image.annotate(name, place, side, textcoords="offset points", fontsize=8)
image.set(title="the image method", xlim=(-0.6, 3.2), ylim=(-1.6, 2.2))

# A slab of thickness t: the wave is transmitted, reflected at both faces, and reflected more than once inside.
angle, thickness = np.radians(35), 0.55
inside = np.arcsin(np.sin(angle) / 2)
slab.axhspan(-thickness, 0, color="0.85")
slab.plot([-np.tan(angle) * 1.4, 0], [1.4, 0], **blue)
hop = thickness * np.tan(inside)
for n in range(3):
    entry = 2 * n * hop
    slab.plot([entry, entry + hop, entry + 2 * hop], [0, -thickness, 0], color="tab:blue", lw=1.2, alpha=0.8**n)
    slab.plot([entry, entry + np.tan(angle) * 1.3], [0, 1.3], color="tab:red", lw=1.6 - 0.5 * n, alpha=0.8**n)
    out = entry + hop
    slab.plot([out, out + np.tan(angle) * 0.9], [-thickness, -thickness - 0.9], color="tab:green", lw=1.6 - 0.5 * n)
slab.annotate("", (-0.55, -thickness), (-0.55, 0), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
slab.text(-0.75, -thickness / 2, "t", va="center")
slab.text(0.75, 1.45, "reflected", color="tab:red", fontsize=8)
slab.text(0.9, -1.75, "transmitted", color="tab:green", fontsize=8)
slab.set(title="a surface stands for a slab", xlim=(-1.3, 2.5), ylim=(-2, 1.8))

# A metal screen with its edge at the origin; the transmitter is on the left.
source = np.array([-1.6, 0.5])
edge.plot([0, 0], [0, -1.9], color="0.3", lw=3)
shadow = -source
edge.fill([0, 2.2, 2.2, 0], [0, 2.2 * shadow[1] / shadow[0], -1.9, -1.9], color="0.9", zorder=0)
edge.plot(*np.stack([source, [0, 0]]).T, **blue)
edge.plot(*np.stack([[0, 0], 1.37 * shadow]).T, color="0.4", ls="--", lw=1)
for turn in np.radians([200, 250, 292, 320, 20, 75, 115]):
    edge.annotate("", 1.1 * np.array([np.cos(turn), np.sin(turn)]), (0, 0), arrowprops={"arrowstyle": "->", **red})
edge.plot(*source, "o", color="black")
edge.text(-1.8, 0.7, "transmitter", fontsize=8)
edge.text(0.7, -1.45, "shadow", fontsize=8)
edge.text(0.95, -0.22, "shadow\nboundary", fontsize=8, color="0.3", va="bottom")
edge.set(title="diffraction at an edge", xlim=(-1.9, 1.9), ylim=(-1.9, 1.9))
for axis in (image, slab, edge):
    axis.set_aspect("equal")
    axis.set_xticks([])
    axis.set_yticks([])
