"""How coarse coordinates in single precision become with the distance from the origin."""

import matplotlib.pyplot as plt
import numpy as np

from scenes.importing.plausibility import COARSE
from scenes.scene.description import FARTHEST

coordinates = np.geomspace(1, 2e7, 400)
steps = np.spacing(coordinates.astype(np.float32))

figure, axis = plt.subplots(figsize=(7, 3.2), layout="constrained")
axis.loglog(coordinates, 1000 * steps, color="tab:blue")
axis.axvline(FARTHEST, color="tab:red", lw=1)
axis.text(
    0.9 * FARTHEST, 2e-4, "refused from here on,\nuntil --shift brings it near", color="tab:red", ha="right", fontsize=8
)
axis.axhline(1000 * COARSE, color="tab:orange", lw=1)
axis.text(1.3, 1300 * COARSE, "warning, if the file has single precision", color="tab:orange", fontsize=8)
utm = 5_334_569.0
axis.plot(utm, 1000 * np.spacing(np.float32(utm)), "o", color="black")
axis.annotate(
    "UTM, 5334569 m:\nrounded to 0.5 m",
    (utm, 500),
    (-12, 0),
    textcoords="offset points",
    ha="right",
    va="center",
    fontsize=8,
)
axis.axhline(125, color="0.5", lw=1, ls=":")
axis.text(1.3, 150, "wavelength at 2.4 GHz", color="0.4", fontsize=8)
axis.set(xlabel="coordinate (m)", ylabel="rounded to (mm)", xlim=(1, 2e7), ylim=(1e-4, 5e3))
axis.grid(alpha=0.3)
