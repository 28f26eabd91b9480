"""A path split at random, in blocks and by area, and uniform positions: how far a test position is from a known one."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial import cKDTree

import bisplat
from learn.data.splits import split
from simulate.dataset.dataset import Dataset
from simulate.dataset.receivers import ArrayReceiver
from simulate.positions.placement import PATH_STEP, place

COUNT = 600
scene = bisplat.load_scene("closet")
rows = (
    ("path, split at random", "path", "random"),
    ("path, split in blocks", "path", "blocked"),
    ("path, split by area", "path", "area"),
    ("uniform positions, split at random", "uniform", "random"),
)
figure, axes = plt.subplots(4, 2, figsize=(8, 9), layout="constrained", width_ratios=(1, 1.15), sharex="col")
for (left, right), (title, placement, kind) in zip(axes, rows, strict=True):
    positions = place(scene, placement, COUNT, seed=3)
    # The splits look at positions alone, so that the pictures may be black.
    black, gateway = np.broadcast_to(np.uint8(0), (COUNT, 90, 360)), scene.gateway
    names = [f"{number:05d}" for number in range(COUNT)]
    none = np.arange(0)
    receiver = ArrayReceiver(gateway.position, gateway.orientation)
    dataset = Dataset(Path("closet"), names, {"spectrum": black}, receiver, positions, none, none)
    parts = split(dataset, kind, seed=0)
    known, test = positions[parts.known], positions[parts.test]
    distance = cKDTree(known).query(test)[0] / scene.wavelength
    left.scatter(*known[:, :2].T, s=4, color="tab:blue", label="known")
    left.scatter(*test[:, :2].T, s=8, color="tab:red", label="test")
    left.set(ylabel="y (m)", aspect="equal", title=title, xlim=(0.36, 1.44), ylim=(0.76, 1.84))
    right.hist(distance, (np.arange(-1, 42) + 0.5) * PATH_STEP / scene.wavelength, color="tab:red")
    right.axvline(np.median(distance), color="black", lw=1.2, label=f"median {np.median(distance):.2f} wavelengths")
    right.set(ylabel="test positions", title="distance to the nearest known position")
    right.set_ylim(0, 1.35 * right.get_ylim()[1])
    right.legend(loc="upper right")
axes[0, 0].legend(loc="upper left", fontsize=7)
axes[-1, 0].set_xlabel("x (m)")
axes[-1, 1].set(xlabel="distance (wavelengths)", xlim=(0, 1))
