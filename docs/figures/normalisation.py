"""What a min–max normalised picture hides: the level, the phases, and which of two mirror images was measured."""

import matplotlib.pyplot as plt
import numpy as np

import bisplat

beamformer = bisplat.Beamformer()
waves = (200, 40, 1.0), (80, 20, 0.5j)  # azimuth, elevation, amplitude
near = 1e-2 * sum(a * beamformer.array.manifold(np.radians(phi), np.radians(theta)) for phi, theta, a in waves)
far = 0.1 * np.exp(2j) * near  # ten times weaker, of another phase
flipped = near[::-1].conj()
row = 40

figure, (left, middle, right) = plt.subplots(1, 3, figsize=(8, 2.7), layout="constrained", width_ratios=(1.2, 1.2, 1))
styles = (near, "near", "-", "tab:blue"), (far, "far", "-", "tab:orange"), (flipped, "flipped", ":", "tab:green")
for responses, name, line, colour in styles:
    spectrum = beamformer.spectrum(responses)
    left.plot(beamformer.power_db(responses)[row], line, color=colour, label=name, lw=2 if line == ":" else 1.5)
    normalised = (spectrum - spectrum.min()) / np.ptp(spectrum)
    middle.plot(normalised[row], line, color=colour, lw={"near": 5, "far": 3, "flipped": 1.5}[name])
    if name != "far":
        right.scatter(100 * responses.real, 100 * responses.imag, s=14, color=colour, label=name)
for axis in (left, middle):
    axis.set(xlabel="azimuth (°)", xlim=(0, 360), xticks=range(0, 361, 90))
    axis.grid(alpha=0.3)
left.set(title="power, row 40", ylabel="dB", ylim=(-85, -20))
middle.set(title="pictures, row 40", ylabel="0…1")
right.set(title="16 responses", xlabel="real part × 100", ylabel="imaginary part × 100", aspect="equal")
left.legend(loc="upper left", ncols=3, fontsize=7, handlelength=1.2, columnspacing=0.8)
right.set(xlim=(-1.7, 1.7), ylim=(-1.5, 2))
right.legend(loc="upper center", ncols=2, fontsize=7, handletextpad=0.1, columnspacing=0.8)
