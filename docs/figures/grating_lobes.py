"""The same plane wave, seen by elements that are half, three quarters of and a whole wavelength apart."""

import matplotlib.pyplot as plt
import numpy as np

import bisplat

figure, axes = plt.subplots(1, 3, figsize=(8, 2.3), sharey=True, layout="constrained")
for axis, spacing in zip(axes, (0.5, 0.75, 1.0), strict=True):
    beamformer = bisplat.Beamformer(bisplat.PlanarArray(spacing=spacing))
    spectrum = beamformer.spectrum(beamformer.array.manifold(np.radians(200), np.radians(30)))
    bisplat.plot_spectrum(spectrum / spectrum.max(), axis)
    axis.plot(200, 30, "+", color="tab:red", ms=8, mew=1.5)
    axis.set_title(f"{spacing:g} λ apart")
    axis.label_outer()
figure.colorbar(axes[0].images[0], ax=axes, label="magnitude")
