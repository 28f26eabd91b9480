"""A wall that is drawn as a box stands for two slabs; as a sheet in the middle it stands for one."""

import matplotlib.pyplot as plt
from matplotlib.patches import Rectangle

THICK = 0.2
figure, axes = plt.subplots(1, 2, figsize=(8, 2.6), layout="constrained", sharey=True)
cases = (("--walls as-drawn: two slabs of 0.2 m", (0, THICK)), ("--walls as-sheets: one slab of 0.2 m", (THICK / 2,)))
for axis, (title, sheets) in zip(axes, cases, strict=True):
    for place in sheets:
        axis.add_patch(Rectangle((place - THICK / 2, 0), THICK, 1, color="tab:blue", alpha=0.3, lw=0))
        axis.axvline(place, color="tab:blue", lw=2)
    axis.add_patch(Rectangle((0, 0), THICK, 1, fill=False, ls="--", lw=1.5))
    axis.annotate("", (0.75, 0.5), (-0.5, 0.5), arrowprops={"arrowstyle": "->", "color": "tab:red"})
    axis.set(xlim=(-0.5, 0.8), ylim=(0, 1), yticks=[], title=title, xlabel="across the wall (m)")
axes[0].text(0.01, 0.9, "wall as drawn", fontsize=8)
