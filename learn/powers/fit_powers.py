"""The methods for received powers by name, and one fitted to a folder: what maps, location and planning start from."""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from learn.powers.helmholtz_powers import HelmholtzPowers
from learn.powers.known_powers import KnownPowers, PowerMethod, PredictedPowers
from learn.powers.mirror_powers import MirrorPowers
from learn.powers.nerf_powers import NerfPowers
from learn.powers.power_baselines import InverseDistance, Kriging, LogDistance, Mean, Mri, Nearest
from learn.powers.twin_powers import TwinPowers
from scenes.files.errors import ParameterError, require_instance, require_seed, require_word, shown
from scenes.files.long_work import doing
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.positions.positions import check_points
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi

POWER_METHODS: dict[str, Callable[[], PowerMethod]] = {
    "mean": Mean,
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "log-distance": LogDistance,
    "mri": Mri,
    "kriging": Kriging,
    "helmholtz": HelmholtzPowers,
    "mirror-images": MirrorPowers,
    "nerf2": NerfPowers,
}
"""Functions that make new, unfitted methods. ``with_twin`` adds the one that also needs a described scene."""

TWIN = "twin"

BASELINES = ("mean", "nearest", "inverse-distance", "log-distance")
"""Methods that the report of another one shows beside it."""


def with_twin(
    dataset: RssiDataset, scene: Scene | Path | str | None, asked: Any
) -> Mapping[str, Callable[[], PowerMethod]]:
    """``POWER_METHODS``, and the twin if there is a scene that it can trace."""
    each = asked.values() if isinstance(asked, Mapping) else asked
    if isinstance(each, str) or not isinstance(each, Collection | None):
        return POWER_METHODS  # what is asked for is refused where the methods are chosen
    names = [] if each is None else [name for name in each if isinstance(name, str)]
    if scene is None:
        if TWIN in names:
            raise ParameterError("scene", f"expected the scene that the method {TWIN} traces, found none")
        return POWER_METHODS
    require_instance(Scene, str, PathLike, scene=scene)
    if each is not None and TWIN not in names:
        found = ", ".join(names) or "none"
        raise ParameterError("scene", f"expected the method {TWIN} with it, which alone traces it, found {found}")
    described = scene if isinstance(scene, Scene) else load_scene(scene)
    twin = TwinPowers(described, dataset)  # refuses what does not fit before anything is fitted
    return POWER_METHODS | {TWIN: partial(copy.copy, twin)}


@dataclass(frozen=True)
class FittedPowers:
    """A method that knows the received powers of a folder, and predicts those at other positions.

    Attributes:
        dataset: the folder's powers.
        label: name of the method.
        known: indices of the known positions, [n].
        method: the fitted method.

    Example:
        >>> import bisplat
        >>> hall = bisplat.write_rssi("court", [[1, 2, 1], [4, 2, 1], [3, 3, 1]], [[-48.0], [-60.0], [-57.0]],
        ...                           {"door": (0, 0, 2)}, "2.4 GHz")
        >>> fitted = bisplat.fit_powers(hall, "inverse-distance")
        >>> fitted
        FittedPowers('inverse-distance', 3 known positions of 'court')
        >>> fitted.predict([[1, 2, 1]]).median.round(1).tolist()
        [[-48.0]]
    """

    dataset: RssiDataset
    label: str
    known: Int[np.ndarray, " n"]
    method: PowerMethod = field(repr=False)

    def __repr__(self) -> str:
        return f"FittedPowers({self.label!r}, {len(self.known)} known positions of {str(self.dataset.folder)!r})"

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedPowers:
        """Predict powers at transmitter positions.

        Args:
            positions: [K, 3] metres, world frame.

        Returns:
            ``median`` [K, G] in dBm, and the ends ``low`` and ``high`` of the 90 % interval, or None where the method
            states none. A power below the dataset's ``floor_dbm`` predicts that nothing is received.

        Raises:
            ParameterError: the positions are not finite points.
        """
        return self.method.predict(check_points(positions, "positions"))


def fit_powers(
    dataset: RssiDataset | Path | str,
    method: str = "helmholtz",
    *,
    known: Int[np.ndarray, " n"] | None = None,
    seed: int = 0,
    scene: Scene | Path | str | None = None,
) -> FittedPowers:
    """Fit a method to received powers (RSSI). Nothing is stored, since it takes seconds, of "twin" and "nerf2" minutes.

    Args:
        dataset: received powers, or their folder.
        method: a name that ``compare_powers`` knows, such as "helmholtz" or "inverse-distance".
        known: indices of the positions to learn from. None: all of them.
        seed: seed of everything that is random in the method.
        scene: the scene that the method "twin" traces, as for ``compare_powers``.

    Returns:
        The fitted method.

    Raises:
        InputError: the folder or the scene cannot be read, or they do not fit.
        ParameterError: the method is unknown, or "twin" without a scene; a scene is given to another method; ``known``
            is not a list of indices; or ``seed`` is no seed.

    Example:
        >>> import bisplat
        >>> hall = bisplat.write_rssi("stadium", [[1, 2, 1], [4, 2, 1], [3, 3, 1]], [[-48.0], [-60.0], [-57.0]],
        ...                           {"door": (0, 0, 2)}, "2.4 GHz")
        >>> bisplat.fit_powers(hall, "nearest").predict([[4, 2.1, 1]]).median.tolist()
        [[-60.0]]
    """
    require_word([*POWER_METHODS, TWIN], method=method)
    require_seed(seed=seed)
    require_instance(RssiDataset, str, PathLike, dataset=dataset)
    dataset = dataset if isinstance(dataset, RssiDataset) else read_rssi(dataset)
    indices = np.arange(len(dataset)) if known is None else checked_indices(known, len(dataset))
    fitted = with_twin(dataset, scene, [method])[method]()
    doing(f"{dataset.folder}: fitting {method} to the powers at {len(indices):,} known positions")
    fitted.fit(KnownPowers.of(dataset, indices, seed))
    doing("")
    return FittedPowers(dataset, method, indices, fitted)


def checked_indices(known: Int[np.ndarray, " n"], count: int) -> Int[np.ndarray, " n"]:
    """Indices of known positions, as an array."""
    given = np.asarray(known)
    if given.ndim == 1 and given.size and given.dtype.kind == "i" and 0 <= given.min() and given.max() < count:
        return given
    raise ParameterError("known", f"expected a list of indices from 0 to {count - 1}, found {shown(known)}")
