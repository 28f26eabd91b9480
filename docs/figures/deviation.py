"""The variance that kriging states along a line between known places, and the deviation that follows from it."""

import matplotlib.pyplot as plt
import numpy as np

from learn.training.conformal_deviation import NORMAL, Deviation

known = np.array([0.3, 0.55, 0.8, 1.3, 1.6, 2.6])
line = np.linspace(0, 3.6, 500)


def kappa(x):
    """Covariance of waves from all sides at distances x (wavelengths), which fades over three wavelengths."""
    return np.sinc(2 * x) * np.exp(-abs(x) / 3)


between = kappa(line[:, None] - known)
among = kappa(known[:, None] - known) + 1e-3 * np.eye(len(known))
variance = np.clip(1 - np.einsum("pk,kl,pl->p", between, np.linalg.inv(among), between), 0, None)
curve = {"gaps": [0.0, 0.1, 0.4, 1.0], "errors": [0.0, 0.03, 0.08, 0.13]}
deviation = Deviation(constant=0.01, growth=1.0, spectra=0, **curve).at(variance, len(line))

figure, (upper, lower) = plt.subplots(2, 1, figsize=(6.8, 4.2), sharex=True, layout="constrained")
upper.plot(line, variance)
upper.set(ylabel="u, relative variance", ylim=(-0.05, 1.1))
lower.fill_between(line, -NORMAL * deviation, NORMAL * deviation, alpha=0.3, label="90 % interval of the error")
lower.plot(line, deviation, label="deviation σ")
lower.set(xlabel="place (wavelengths)", ylabel="error of a value (0…1)", xlim=(0, 3.6))
lower.legend(loc="lower left", ncols=2)
for axis in (upper, lower):
    axis.plot(known, np.zeros_like(known), "o", color="black", ms=5, clip_on=False)
    axis.grid(alpha=0.3)
upper.annotate("known places", (1.3, 0), (0.85, 0.35), arrowprops={"arrowstyle": "-", "lw": 0.8})
