"""Two panels and a distribution at the width of a column. The spectra are of a source and its images in four walls."""

import matplotlib.pyplot as plt
import numpy as np

import bisplat

plt.rcParams.update({"font.family": "serif", "font.size": 8, "mathtext.fontset": "cm"})
WAVELENGTH, IMAGES = 0.328, ((1, 1, 1.0), (-1, 1, 0.6), (1, -1, 0.5), (-1, -1, 0.3))  # signs of x and y; amplitude

random = np.random.default_rng(0)
positions = random.uniform([1, -1, 2], [2, 1, 4], (400, 3))  # gateway at the origin, boresight +z
beamformer = bisplat.Beamformer()
elements = beamformer.array.positions * WAVELENGTH
responses = np.zeros((400, 16), complex)
for x, y, amplitude in IMAGES:
    images = (positions + np.array([3, 2, 0])) * np.array([x, y, 1]) - np.array([3 * x, 2, 0])
    distance = np.linalg.norm(images[:, None] - elements, axis=-1)
    responses += amplitude * np.exp(-2j * np.pi * distance / WAVELENGTH) / distance
spectra = beamformer.spectrum(responses)
spectra -= spectra.min(axis=(1, 2), keepdims=True)
spectra /= spectra.max(axis=(1, 2), keepdims=True)

known, test = np.arange(300), np.arange(300, 400)
away = np.linalg.norm(positions[test][:, None] - positions[known], axis=-1)
four = np.argsort(away, axis=1)[:, :4]
weights = 1 / np.take_along_axis(away, four, axis=1)
averaged = np.einsum("tn,tnhw->thw", weights / weights.sum(axis=1, keepdims=True), spectra[four])
ssim = {
    "inverse distance": bisplat.ssim(averaged, spectra[test]),
    "nearest": bisplat.ssim(spectra[four[:, 0]], spectra[test]),
}

chosen = np.argsort(ssim["inverse distance"])[len(test) // 2]
figure, axes = plt.subplots(2, 1, figsize=(3.5, 2.9), sharex=True, layout="constrained")
bisplat.plot_spectrum(spectra[test][chosen], axes[0]).set_title("truth")
bisplat.plot_spectrum(averaged[chosen], axes[1])
axes[1].set_title(f"predicted, SSIM {ssim['inverse distance'][chosen]:.3f}")
for each in axes:
    each.label_outer()
figure.colorbar(axes[0].images[0], ax=axes, label="normalised magnitude")

figure, axes = plt.subplots(figsize=(3.5, 2.4), layout="constrained")
for name, scores in ssim.items():
    axes.ecdf(scores, label=f"{name}: median {np.median(scores):.3f}")
axes.set(xlabel="SSIM", ylabel="share of spectra")
axes.legend(fontsize=6)
