"""How data flow through BiSplat-WRF, from a transmitter's position to a spectrum."""

import matplotlib.pyplot as plt
from matplotlib.patches import FancyBboxPatch

BOXES = {  # centre x and y, width, text, colour
    "primitives": (1.2, 4.4, 2.1, "primitives\n$i = 1…N_p$\n$(φ_i, θ_i, d_i)$", "#dbe9f6"),
    "position": (1.2, 0.9, 2.1, "transmitter\nposition $r$", "#dbe9f6"),
    "gs": (3.65, 4.4, 1.7, "encoding\nGS-PE", "#eeeeee"),
    "tx": (3.65, 0.9, 1.7, "encoding\nTX-PE", "#eeeeee"),
    "static": (6.15, 5.15, 2.1, "static network:\namplitude, phase", "#fde7cf"),
    "bst": (6.15, 2.5, 2.1, "BST:\n64 clusters of\nprimitives\nattend to\neach other", "#fbd5d5"),
    "dynamic": (8.9, 3.6, 2.1, "dynamic\nnetwork: changes\nof both", "#fde7cf"),
    "delta": (8.9, 1.2, 2.1, "delta decoder:\nchanges of scales,\nrotation, opacity", "#fde7cf"),
    "mix": (11.5, 4.4, 1.9, "mixing:\ncoefficient $c_i$", "#e3f1df"),
    "splat": (11.5, 1.9, 1.9, "splatting from\nnear to far:\nfield $F(φ, θ)$", "#e3f1df"),
    "spectrum": (13.9, 1.9, 1.6, "spectrum\n$|F|^2$", "#dbe9f6"),
}
ARROWS = (  # from, to, and the bend
    ("primitives", "gs", 0),
    ("position", "tx", 0),
    ("gs", "static", 0),
    ("gs", "bst", 0),
    ("tx", "bst", 0),
    ("bst", "dynamic", 0),
    ("bst", "delta", 0),
    ("tx", "delta", 0.12),
    ("static", "mix", -0.12),
    ("dynamic", "mix", 0),
    ("delta", "splat", 0),
    ("mix", "splat", 0),
    ("splat", "spectrum", 0),
)
figure, axis = plt.subplots(figsize=(8, 4.0), layout="constrained")
HEIGHT = {"bst": 1.9}
patches = {}
for name, (x, y, width, text, colour) in BOXES.items():
    height = HEIGHT.get(name, 1.2)
    corner = (x - width / 2, y - height / 2)
    patches[name] = axis.add_patch(
        FancyBboxPatch(corner, width, height, boxstyle="round,pad=0.04", fc=colour, ec="0.3", lw=0.9)
    )
    axis.text(x, y, text, ha="center", va="center", fontsize=8)
for start, end, bend in ARROWS:
    axis.annotate(
        "",
        BOXES[end][:2],
        BOXES[start][:2],
        arrowprops={
            "arrowstyle": "-|>",
            "patchA": patches[start],
            "patchB": patches[end],
            "connectionstyle": f"arc3,rad={bend}",
            "color": "0.25",
            "lw": 1.1,
        },
    )
axis.set(xlim=(0.05, 14.8), ylim=(0.1, 5.9))
axis.set_axis_off()
