"""The methods that ``compare_rooms`` knows: some learn in the known spectra of a room alone, some in other rooms."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Float

from learn.baselines.neighbours import inverse_distance, mean_picture, nearest
from learn.models.base import SpectrumModel
from learn.models.images.image_field import ImageField
from learn.models.kriging.helmholtz import HelmholtzField
from learn.rooms.known_in_room import KnownInRoom
from learn.rooms.neighbour_attention import AttentionOverNeighbours
from learn.training.prediction import predict
from learn.twin.twin_model import Twin
from scenes.files.errors import InputError
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import unknowns, vary
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.engines.rays_engine import Rays

WRONG_BY = Tolerances(position=0.03, rotation=2.0, objects=0.03, materials=0.2)
"""Standard deviations of the errors in the description of a room that the twin gets."""


class RoomMethod(Protocol):
    """A method that predicts spectra in a room of which some are known.

    A method that also has ``learn(rooms, minutes, seed)`` is given the datasets of the training rooms before.
    """

    def fit(self, room: KnownInRoom) -> None:
        """Take the known spectra of a room."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        """Predict spectra, 0…1, in this room, at transmitter positions in metres, world frame."""


class MeanOfKnown:
    """The mean of all known spectra: k nearest neighbours with k = L."""

    def fit(self, room: KnownInRoom) -> None:
        self._room = room

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return mean_picture(self._room.spectra, positions)


class NearestKnown(MeanOfKnown):
    """A copy of the nearest known spectrum."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return nearest(self._room.positions, self._room.spectra, positions)


class InverseDistanceInRoom(MeanOfKnown):
    """The mean of the four nearest known spectra, weighted by 1 / distance."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return inverse_distance(self._room.positions, self._room.spectra, positions)


class _Modelled:
    """Base of methods that fit a model to the known spectra of one room."""

    _model: SpectrumModel

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return predict(self._model, positions).spectra


class HelmholtzInRoom(_Modelled):
    """``helmholtz``, fitted to the known spectra and responses of the room alone."""

    def fit(self, room: KnownInRoom) -> None:
        dataset = room.dataset
        model = HelmholtzField(_box(room), dataset.beamformer, dataset.wavelength)
        model.fit(dataset, room.known)
        self._model = model


class HelmholtzOfPictures(_Modelled):
    """``helmholtz``, fitted to the pictures of the room alone, as the methods that learn in other rooms see them."""

    def fit(self, room: KnownInRoom) -> None:
        dataset = replace(room.dataset, responses=None)
        model = HelmholtzField(_box(room), dataset.beamformer, dataset.wavelength)
        model.fit(dataset, room.known)
        self._model = model


class ImagesInRoom(_Modelled):
    """``mirror-images``, fitted to the known responses of the room alone, with the gateway's place and orientation."""

    def fit(self, room: KnownInRoom) -> None:
        dataset = room.dataset
        model = ImageField(_box(room), dataset.beamformer, dataset.wavelength)
        model.fit(dataset, room.known)
        self._model = model


class TwinInRoom(_Modelled):
    """``twin``, with a description of the room that has errors of ``WRONG_BY``.

    Its rays follow what those of the dataset followed, so that nothing but the description is wrong.
    """

    def fit(self, room: KnownInRoom) -> None:
        dataset = room.dataset
        scene = load_scene(_scene_of(dataset))
        which = unknowns(scene, WRONG_BY)
        errors = np.random.default_rng(room.seed).normal(size=len(which)) * [each.tolerance for each in which]
        with tempfile.TemporaryDirectory() as folder:
            described = write_scene(vary(scene, which, errors), Path(folder))
            model = Twin(_box(room), dataset.beamformer, dataset.wavelength, scene=str(described))
        model.propagation = replace(Rays.of(dataset.metadata).propagation, sionna=False, diffuse=False)
        model.fit(dataset, np.sort(room.known))
        self._model = model


def _box(room: KnownInRoom) -> Float[np.ndarray, "2 3"]:
    """The box around the known positions, metres."""
    return np.stack([room.positions.min(axis=0), room.positions.max(axis=0)])


def _scene_of(dataset: Dataset) -> Path:
    path = dataset.folder / "scene" / "scene.yaml"
    if not path.is_file():
        raise InputError(f"{path}: expected the scene of the room, which the twin needs, found no such file")
    return path


ROOM_METHODS: dict[str, Callable[[], RoomMethod]] = {
    "mean": MeanOfKnown,
    "nearest": NearestKnown,
    "inverse-distance": InverseDistanceInRoom,
    "helmholtz": HelmholtzInRoom,
    "helmholtz-pictures": HelmholtzOfPictures,
    "mirror-images": ImagesInRoom,
    "attention": AttentionOverNeighbours,
    "twin": TwinInRoom,
}
"""The methods by name."""

USUAL: Sequence[str] = "mean", "nearest", "inverse-distance", "helmholtz", "mirror-images", "attention"
"""The methods that are compared if none are named. The others take minutes for each room and number."""
