"""One plane wave, and two that are 18° apart, as arrays of three sizes see them."""

import matplotlib.pyplot as plt
import numpy as np

import bisplat

elevation = np.radians(45)
one = [180.0]
two = [167.0, 193.0]  # 26° of azimuth at elevation 45° are 18° of arc

figure, axes = plt.subplots(2, 3, figsize=(8, 3.9), sharex=True, sharey=True, layout="constrained")
for column, size in enumerate((4, 8, 16)):
    beamformer = bisplat.Beamformer(bisplat.PlanarArray(rows=size, columns=size))
    for row, azimuths in enumerate((one, two)):
        axis = axes[row, column]
        # The second wave is a quarter of a period late, so that the two neither add up nor cancel.
        responses = sum(
            1j**i * beamformer.array.manifold(np.radians(azimuth), elevation) for i, azimuth in enumerate(azimuths)
        )
        spectrum = beamformer.spectrum(responses)
        bisplat.plot_spectrum(spectrum / spectrum.max(), axis)
        axis.plot(azimuths, [45] * len(azimuths), "+", color="tab:red", ms=8, mew=1.5)
        if row == 0:
            axis.set_title(f"{size} × {size} elements")
        axis.label_outer()
axes[0, 0].set_ylabel("one wave\nelevation (°)")
axes[1, 0].set_ylabel("two waves\nelevation (°)")
figure.colorbar(axes[0, 0].images[0], ax=axes, label="magnitude", shrink=0.8)
