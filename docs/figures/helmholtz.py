"""Helmholtz kriging: plane waves from all sides with shares of the power, the covariances, and a field interpolated."""

import matplotlib.pyplot as plt
import numpy as np

from learn.models.encoding import evenly_spread_directions
from learn.models.kriging.kriged_field import DIRECTIONS

u = evenly_spread_directions(DIRECTIONS).numpy()
sides = np.array([[-1, 0.2, 0.3], [0.3, -1, 0.2], [-0.2, 0.5, -1]])
sides /= np.linalg.norm(sides, axis=1, keepdims=True)
shares = 0.01 + 9 * np.exp(40 * (u @ sides[0] - 1)) + 2 * np.exp(40 * (u @ sides[1:].T - 1)).sum(axis=1)
shares /= shares.sum()


def kappa(x, of):
    """Covariance at distances x (wavelengths) along the x axis: a length of six wavelengths."""
    return (of * np.exp(2j * np.pi * x[..., None] * u[:, 0])).sum(axis=-1) * np.exp(-abs(x) / 6)


figure = plt.figure(figsize=(8, 2.9), layout="constrained")
sphere = figure.add_subplot(1, 3, 1, projection="3d")
sphere.scatter(*u.T, s=4 + 900 * shares, c=shares, cmap="viridis", depthshade=False)
sphere.set_box_aspect((1, 1, 1), zoom=1.35)
sphere.set_axis_off()
sphere.set_title("shares of 100 directions")

covariance = figure.add_subplot(1, 3, 2)
distance = np.linspace(0, 3, 400)
single = np.eye(DIRECTIONS)[np.argmax(shares)]
equal = np.full(DIRECTIONS, 1 / DIRECTIONS)
for of, label, style in ((single, "one direction", "--"), (shares, "these shares", "-"), (equal, "equal shares", ":")):
    covariance.plot(distance, abs(kappa(distance, of)), style, label=label)
covariance.set(title="covariance", xlabel="distance (wavelengths)", ylabel="|κ|", ylim=(0, 1.02), xlim=(0, 3))
covariance.legend(fontsize=7)
covariance.grid(alpha=0.3)

# A field of such waves along a line, known at seven places, and two ways of interpolating it.
generator = np.random.default_rng(5)
line = np.linspace(0, 3.6, 400)
waves = np.sqrt(shares) * (generator.normal(size=DIRECTIONS) + 1j * generator.normal(size=DIRECTIONS))
field = (waves * np.exp(2j * np.pi * line[:, None] * u[:, 0])).sum(axis=1)
known = np.linspace(0, 399, 7).astype(int)


def kriged(covariance_of):
    among = covariance_of(line[known][:, None] - line[known]) + 1e-6 * np.eye(len(known))
    return covariance_of(line[:, None] - line[known]) @ np.linalg.solve(among, field[known])


shown = figure.add_subplot(1, 3, 3)
shown.plot(line, field.real, color="black", lw=1.4, label="field")
shown.plot(line, kriged(lambda x: kappa(x, shares)).real, "--", color="tab:orange", lw=2, label="by waves")
smooth = kriged(lambda x: np.exp(-((x / 0.35) ** 2) / 2)).real
shown.plot(line, smooth, ":", color="tab:purple", lw=1.8, label="smooth")
shown.plot(line[known], field[known].real, "o", color="black", ms=4)
shown.set(title="a field, known at dots", xlabel="place (wavelengths)", ylabel="real part", ylim=(-3, 4.4))
shown.legend(fontsize=7, loc="upper right", ncols=3, columnspacing=0.8, handlelength=1.4)
