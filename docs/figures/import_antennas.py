"""Gateways and regions in a room seen from the side: in usual places, and in odd ones that are warned of."""

import matplotlib.pyplot as plt
from matplotlib.patches import Rectangle

import bisplat
from scenes.importing.plausibility import antenna_warnings

room = bisplat.SceneObject("room", bisplat.shapes.box((0, 0, 0), (5, 4, 3)), "concrete")
concrete = bisplat.p2040_materials(["concrete"], 2.4e9)
usual = ((1, 1, 0.8), (2.5, 3, 1.7))
cases = (
    ("as it should be", (4.6, 2, 1.8), -1, usual),
    ("looks away", (4.6, 2, 1.8), 1, usual),
    ("above the ceiling", (4.6, 2, 3.6), -1, usual),
    ("below the floor", (4.6, 2, -0.5), -1, usual),
    ("outside", (5.6, 2, 1.8), -1, usual),
    ("a part is outside", (4.6, 2, 1.8), -1, ((-0.8, 1, 0.8), (1.2, 3, 1.7))),
)
figure, axes = plt.subplots(2, 3, figsize=(8, 4), layout="constrained")
for axis, (title, position, forward, (low, high)) in zip(axes.flat, cases, strict=True):
    gateway = bisplat.Gateway(position, bisplat.facing((forward, 0, 0)))
    scene = bisplat.Scene("room", 2.4e9, gateway, bisplat.Transmitter(low, high), (room,), concrete)
    color = "tab:red" if antenna_warnings(scene) else "tab:green"
    axis.add_patch(Rectangle((0, 0), 5, 3, fill=False, lw=2, color="0.4"))
    axis.add_patch(Rectangle((low[0], low[2]), high[0] - low[0], high[2] - low[2], color=color, alpha=0.3))
    axis.plot(position[0], position[2], "o", color=color)
    axis.annotate(
        "", (position[0] + 0.9 * forward, position[2]), (position[0], position[2]), arrowprops={"arrowstyle": "->"}
    )
    axis.set(xlim=(-1.2, 6.2), ylim=(-0.9, 4.1), aspect="equal", title=title)
    axis.set_axis_off()
