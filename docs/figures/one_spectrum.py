"""The spectrum of two waves at a 4 × 4 array: the direct one, and a weaker one reflected by a wall."""

import matplotlib.pyplot as plt
import numpy as np

import bisplat

WAVES = {"direct": (210, 55, 1.0), "reflected": (70, 30, 0.6)}  # azimuth and elevation, degrees; amplitude

beamformer = bisplat.Beamformer()
responses = sum(
    amplitude * beamformer.array.manifold(np.radians(float(azimuth)), np.radians(float(elevation)))
    for azimuth, elevation, amplitude in WAVES.values()
)
spectrum = beamformer.spectrum(responses)
spectrum = (spectrum - spectrum.min()) / np.ptp(spectrum)

figure, axes = plt.subplots(figsize=(7.2, 2.8))
bisplat.plot_spectrum(spectrum, axes)
for name, (azimuth, elevation, _) in WAVES.items():
    axes.plot(azimuth, elevation, "o", color="white", fillstyle="none", markersize=9)
    axes.annotate(name, (azimuth, elevation), (9, 5), textcoords="offset points", color="white")
figure.colorbar(axes.images[0], label="normalised magnitude")
