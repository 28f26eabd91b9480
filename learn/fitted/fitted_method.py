"""A method fitted to some rows of a dataset, of any quantity: what maps, location and planning start from."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, Num

from learn.comparison.given_methods import built, chosen_methods, named
from learn.comparison.predictions import Predictions
from learn.data.splits import Split
from learn.methods.method_table import methods_of, require_scene
from learn.quantities.known import Known, Method
from learn.quantities.quantity import Prediction, Quantity
from learn.quantities.quantity_table import quantity_named
from scenes.files.errors import ParameterError, shown
from scenes.files.long_work import doing
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.positions.positions import check_points


@dataclass(frozen=True)
class Fitted:
    """A method that knows some rows of a dataset, and predicts others."""

    dataset: Dataset
    quantity: Quantity
    label: str  # name of the method
    known: Int[np.ndarray, " n"]  # indices of the known rows
    method: Method = field(repr=False)

    def __repr__(self) -> str:
        return f"Fitted({self.label!r}, {len(self.known)} known {self.quantity.things} of {str(self.dataset.folder)!r})"

    def predict(
        self, positions: Float[np.ndarray, "K 3"] | None, given: Num[np.ndarray, "K ..."] | None = None
    ) -> Prediction:
        """Predict at positions, metres, world frame, of channels from what is given of their rows."""
        places = None if positions is None else check_points(positions, "positions")
        sample = self.quantity.given(self.dataset, self.known[:1])
        if sample is not None and (given is None or np.shape(given)[1:] != sample.shape[1:]):
            expected = f"expected an array [K, {', '.join(map(str, sample.shape[1:]))}] of the {self.quantity.name}"
            raise ParameterError("given", f"{expected} that each row is predicted from, found {shown(given)}")
        given = None if sample is None else given
        count = len(places) if given is None and places is not None else len(np.asarray(given))
        shape = (count, *self.quantity.of(self.dataset, self.known[:1]).shape[1:])
        with named(self.label, self.method, "predict to return predictions"):
            return self.quantity.predicted_by(self.label, self.method, places, given, shape)


def make_method(
    dataset: Dataset, quantity: str, method: str, scene: Scene | Path | str | None = None
) -> tuple[str, Method]:
    """The label of a method that is named as for ``compare``, and a new, unfitted one."""
    require_scene(quantity, [method], scene)
    try:
        [(label, make)] = chosen_methods([method], methods_of(quantity, dataset, scene), [], models=False).items()
        made = built(label, make)
    except ParameterError as error:
        raise ParameterError("model", error.message) from error
    if isinstance(made, Predictions):
        raise ParameterError("model", f"expected a method that is fitted, found the predictions {label}")
    return label, made


def fit_method(
    data: Dataset | Path | str,
    quantity: str,
    method: str = "helmholtz",
    *,
    known: Int[np.ndarray, " n"] | None = None,
    seed: int = 0,
    scene: Scene | Path | str | None = None,
    steps: int | None = None,
    minutes: float | None = 5.0,
) -> Fitted:
    """Fit a method, named as for ``compare``, to some rows of a dataset; ``known`` is None: to all of them."""
    dataset, of = data if isinstance(data, Dataset) else read_dataset(data), quantity_named(quantity)
    of.require(dataset)
    label, made = make_method(dataset, quantity, method, scene)
    rows = np.arange(len(dataset)) if known is None else np.asarray(known)
    nothing = np.zeros(0, int)
    taught = Known(dataset, of, Split(train=np.sort(rows), validation=nothing, test=nothing), seed, minutes, steps)
    doing(f"{dataset.folder}: fitting {label} to {len(rows):,} known {of.things}")
    with named(label, made, "fit to learn from what is known"):
        made.fit(taught)
    return Fitted(dataset, of, label, rows, made)
