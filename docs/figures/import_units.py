"""How large a room of 5 x 4 x 3 m becomes by each unit, beside the space between gateway and region."""

import matplotlib.pyplot as plt
import numpy as np

from scenes.files.lengths import METRES
from scenes.importing.plausibility import DOUBTED, REFUSED, unit_doubt

room = np.array([[0, 0, 0], [5.0, 4.0, 3.0]])
antennas = np.array([[4.7, 2, 1.8], [1, 1, 0.8], [2.5, 3, 1.7]])
span = np.linalg.norm(np.ptp(antennas, axis=0))

figure, axis = plt.subplots(figsize=(8, 3), layout="constrained")
axis.axvspan(*DOUBTED, color="tab:green", alpha=0.2, label="accepted")
for low, high in ((REFUSED[0], DOUBTED[0]), (DOUBTED[1], REFUSED[1])):
    axis.axvspan(low, high, color="tab:orange", alpha=0.25, label="doubted" if low < 1 else None)
for low, high in ((1e-4, REFUSED[0]), (REFUSED[1], 1e4)):
    axis.axvspan(low, high, color="tab:red", alpha=0.2, label="refused" if low < 1 else None)
for row, metres in enumerate(METRES.values()):
    for read, other in METRES.items():
        bounds = room * other / metres
        doubt = unit_doubt(bounds, antennas, read, 0.125)
        color = "tab:green" if doubt is None else "tab:red" if doubt.decisive else "tab:orange"
        ratio = np.linalg.norm(bounds[1]) / span
        axis.plot(ratio, row, "o", color=color)
        axis.annotate(read, (ratio, row), (0, 4), textcoords="offset points", ha="center", fontsize=7)
axis.set(
    xscale="log",
    xlim=(1e-4, 1e4),
    ylim=(-0.5, len(METRES) - 0.3),
    yticks=range(len(METRES)),
    yticklabels=[f"drawn in {unit}" for unit in METRES],
    xlabel="size of the scene / size of the box around gateway and region",
    title="a room, read with each unit",
)
axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.1), ncols=3, fontsize=8)
