"""Why a spectrum of a 4 × 4 array has 49 degrees of freedom: its lags, and singular values of squared spectra."""

import matplotlib.pyplot as plt
import numpy as np

import bisplat

array = bisplat.PlanarArray()
places = np.round(array.positions[:, :2] / array.spacing + 1.5).astype(int)
differences = (places[:, None] - places).reshape(-1, 2)
lags, pairs = np.unique(differences, axis=0, return_counts=True)

generator = np.random.default_rng(0)
responses = generator.normal(size=(120, 16)) + 1j * generator.normal(size=(120, 16))
squares = bisplat.Beamformer().spectrum(responses)[:, ::5, ::5].reshape(120, -1) ** 2
singular = np.linalg.svd(squares, compute_uv=False)

figure, (left, middle, right) = plt.subplots(1, 3, figsize=(8, 2.9), layout="constrained", width_ratios=(1, 1.15, 1.4))
left.scatter(*places.T, color="tab:blue", s=45, zorder=2)
for start, end in (((0, 0), (2, 1)), ((1, 2), (3, 3))):
    left.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": "tab:red", "lw": 1.6})
left.set(
    title="16 elements",
    xlabel="x (spacings)",
    ylabel="y (spacings)",
    xlim=(-0.6, 3.6),
    ylim=(-0.6, 3.6),
    xticks=range(4),
    yticks=range(4),
)
middle.scatter(*lags.T, s=6 + 7 * pairs, color="tab:blue")
middle.scatter(2, 1, s=6 + 7 * pairs[(lags == (2, 1)).all(axis=1)], color="tab:red")
middle.set(
    title=f"{len(lags)} lags",
    xlabel="Δx (spacings)",
    ylabel="Δy (spacings)",
    xlim=(-3.7, 3.7),
    ylim=(-3.7, 3.7),
    xticks=range(-3, 4),
)
for axis in (left, middle):
    axis.set_aspect("equal")
right.semilogy(np.arange(1, 121), singular / singular[0], ".", ms=4)
right.axvline(49.5, color="tab:red", lw=1)
right.text(52, 1e-7, "49", color="tab:red")
right.set(title="120 random squared spectra", xlabel="number", ylabel="singular value, relative", ylim=(1e-17, 3))
right.grid(alpha=0.3)
