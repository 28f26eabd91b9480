"""How alike the spectra of two transmitters are, by their distance: the closet in full wave."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import bisplat
from simulate.fullwave.stored_field import read_stored_field
from simulate.spectra.spectrum import normalise

ROOT = Path(bisplat.__file__).parents[1]
scene = bisplat.load_scene("closet")
field = read_stored_field(ROOT / "tests" / "data" / "closet" / "field.npz")
low, high = scene.transmitter.region

generator = np.random.default_rng(0)
distances = np.geomspace(0.01, 1, 9) * scene.wavelength
pairs, scores = 16, []
for distance in distances:
    first = generator.uniform(low + 0.01, high - 0.01, (20 * pairs, 3))
    step = generator.normal(size=first.shape)
    second = first + distance * step / np.linalg.norm(step, axis=1, keepdims=True)
    inside = ((second > low) & (second < high)).all(axis=1)
    ends = np.concatenate([first[inside][:pairs], second[inside][:pairs]])
    spectra = normalise(bisplat.Beamformer().spectrum(field.responses(ends)))
    scores.append([bisplat.ssim(*both) for both in zip(*np.split(spectra, 2), strict=True)])

middle, quarter, three_quarters = (np.quantile(scores, share, axis=1) for share in (0.5, 0.25, 0.75))
axis = plt.subplots(figsize=(6.4, 3.4), layout="constrained")[1]
axis.fill_between(distances / scene.wavelength, quarter, three_quarters, alpha=0.25, label="half of the pairs")
axis.semilogx(distances / scene.wavelength, middle, "o-", ms=4, label="median")
axis.set(xlabel="distance of the two transmitters (wavelengths)", ylabel="SSIM of their spectra", ylim=(0.4, 1.01))
ticks = 0.01, 0.03, 0.1, 0.3, 1
axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
axis.grid(alpha=0.3)
axis.legend(loc="lower left")
