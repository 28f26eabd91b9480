"""The field of one element of the closet's gateway in full wave: level and phase over the transmitters' region."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import bisplat
from simulate.fullwave.stored_field import read_stored_field

scene = bisplat.load_scene("closet")
field = read_stored_field(Path(bisplat.__file__).parents[1] / "tests" / "data" / "closet" / "field.npz")
(x0, y0, _), (x1, y1, _) = scene.transmitter.region
x, y = np.meshgrid(np.linspace(x0, x1, 81), np.linspace(y0, y1, 81))
places = np.stack([x, y, np.full_like(x, 1.15)], axis=-1)
response = field.responses(places.reshape(-1, 3))[:, 5].reshape(x.shape)

figure, (level, phase) = plt.subplots(1, 2, figsize=(8, 3.4), sharey=True, layout="constrained")
extent = (x0, x1, y0, y1)
shown = level.imshow(20 * np.log10(abs(response)), origin="lower", extent=extent, interpolation="bicubic")
figure.colorbar(shown, ax=level, label="channel gain (dB)")
angle = np.angle(response, deg=True)
shown = phase.imshow(angle, origin="lower", extent=extent, cmap="twilight", vmin=-180, vmax=180)
figure.colorbar(shown, ax=phase, label="phase (°)", ticks=range(-180, 181, 90))
level.plot([x0 + 0.05, x0 + 0.05 + scene.wavelength], [y0 + 0.05] * 2, color="white", lw=2)
level.text(x0 + 0.05, y0 + 0.07, "one wavelength", color="white")
level.set(title="level", xlabel="x (m)", ylabel="y (m)")
phase.set(title="phase", xlabel="x (m)")
