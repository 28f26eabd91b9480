"""One spectrum as the rows and columns of a picture, and as the gateway sees it."""

import matplotlib.pyplot as plt
import numpy as np

import bisplat

beamformer = bisplat.Beamformer()
waves = (2, 35, 1.0), (215, 70, 0.8j)  # azimuth, elevation, amplitude
spectrum = beamformer.spectrum(
    sum(a * beamformer.array.manifold(np.radians(phi), np.radians(theta)) for phi, theta, a in waves)
)
figure = plt.figure(figsize=(8, 3.2), layout="constrained")
flat = figure.add_subplot(1, 2, 1)
bisplat.plot_spectrum(spectrum / spectrum.max(), flat)
flat.set_title("the picture: 90 rows, 360 columns")
polar = figure.add_subplot(1, 2, 2, projection="polar")
bisplat.plot_spectrum(spectrum / spectrum.max(), polar)
polar.set_title("the half space in front of the array")
figure.colorbar(flat.images[0], ax=[flat, polar], label="magnitude", shrink=0.9)
