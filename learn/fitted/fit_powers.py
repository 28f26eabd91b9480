"""A method fitted to the received powers of a folder: what maps, location and planning start from."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from learn.methods.method_table import methods_of, require_scene
from learn.quantities.known import Known, Method
from learn.quantities.quantity import Prediction
from learn.quantities.quantity_table import quantity_named
from scenes.files.errors import ParameterError, require_seed, require_word, shown
from scenes.files.long_work import doing
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset
from simulate.positions.positions import check_points


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
        >>> heard = {"powers": [[-48.0], [-60.0], [-57.0]], "gateways": {"door": (0, 0, 2)}, "frequency": "2.4 GHz"}
        >>> hall = bisplat.write_dataset("court", [[1, 2, 1], [4, 2, 1], [3, 3, 1]], **heard)
        >>> fitted = bisplat.fit_powers(hall, "inverse-distance")
        >>> fitted
        FittedPowers('inverse-distance', 3 known positions of 'court')
        >>> fitted.predict([[1, 2, 1]]).value.round(1).tolist()
        [[-48.0]]
    """

    dataset: Dataset
    label: str
    known: Int[np.ndarray, " n"]
    method: Method = field(repr=False)

    def __repr__(self) -> str:
        return f"FittedPowers({self.label!r}, {len(self.known)} known positions of {str(self.dataset.folder)!r})"

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Prediction:
        """Predict powers at transmitter positions.

        Args:
            positions: [K, 3] metres, world frame.

        Returns:
            ``value`` [K, G] in dBm, and the ends ``low`` and ``high`` of the 90 % interval, or None where the method
            states none. A power below the dataset's ``floor_dbm`` predicts that nothing is received.

        Raises:
            ParameterError: the positions are not finite points.
        """
        found = self.method.predict(check_points(positions, "positions"))
        assert isinstance(found, Prediction)
        return found


def fit_powers(
    dataset: Dataset | Path | str,
    method: str = "helmholtz",
    *,
    known: Int[np.ndarray, " n"] | None = None,
    seed: int = 0,
    scene: Scene | Path | str | None = None,
) -> FittedPowers:
    """Fit a method to received powers (RSSI). Nothing is stored, since it takes seconds, of "twin" and "nerf2" minutes.

    Args:
        dataset: received powers, or their folder.
        method: a name that ``compare`` knows for powers, such as "helmholtz" or "inverse-distance".
        known: indices of the positions to learn from. None: all of them.
        seed: seed of everything that is random in the method.
        scene: the scene that the method "twin" traces, as for ``compare``.

    Returns:
        The fitted method.

    Raises:
        InputError: the folder or the scene cannot be read, or they do not fit.
        ParameterError: the method is unknown, or "twin" without a scene; a scene is given to another method; ``known``
            is not a list of indices; or ``seed`` is no seed.

    Example:
        >>> import bisplat
        >>> heard = {"powers": [[-48.0], [-60.0], [-57.0]], "gateways": {"door": (0, 0, 2)}, "frequency": "2.4 GHz"}
        >>> hall = bisplat.write_dataset("stadium", [[1, 2, 1], [4, 2, 1], [3, 3, 1]], **heard)
        >>> bisplat.fit_powers(hall, "nearest").predict([[4, 2.1, 1]]).value.tolist()
        [[-60.0]]
    """
    require_seed(seed=seed)
    dataset = given_dataset(dataset, "power")
    indices = np.arange(len(dataset)) if known is None else checked_indices(known, len(dataset))
    require_scene("power", [method], scene)
    methods = methods_of("power", dataset, scene)
    require_word(tuple(methods), method=method)
    fitted = methods[method]()
    doing(f"{dataset.folder}: fitting {method} to the powers at {len(indices):,} known positions")
    fitted.fit(Known.of(dataset, quantity_named("power"), indices, seed))
    return FittedPowers(dataset, method, indices, fitted)


def checked_indices(known: Int[np.ndarray, " n"], count: int) -> Int[np.ndarray, " n"]:
    """Indices of known positions, as an array."""
    given = np.asarray(known)
    if given.ndim == 1 and given.size and given.dtype.kind == "i" and 0 <= given.min() and given.max() < count:
        return given
    raise ParameterError("known", f"expected a list of indices from 0 to {count - 1}, found {shown(known)}")
