"""The subject of the viewer: a run with its dataset and scene, a dataset of any quantity with its scene, or a scene."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from threading import RLock
from typing import NamedTuple, TypeVar

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from scipy.spatial import cKDTree

from learn.data.metrics import ssim
from learn.data.neighbours import NEIGHBOURS, inverse_distance, nearest
from learn.data.splits import Split
from learn.evaluation.crossvalidate import seen_by
from learn.fitted.fitted_method import Fitted, fit_method
from learn.models.capabilities import HasPrimitives, PredictsResponses
from learn.models.splatting.splat import Splats
from learn.training.run_folder import SpectrumRun, load_spectra
from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway
from scenes.scene.description import SPEED_OF_LIGHT, Scene
from scenes.scene.shapes import bounding_box
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset, require_fixed_end
from simulate.dataset.receivers import ArrayReceiver
from simulate.dataset.rooms_folder import scene_of
from simulate.engines.rays_engine import Rays, seed_of_rays
from simulate.rays.core.propagation import Propagation
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import evenly, picture, spectrum_of

SHOWN = 400  # Largest number of test positions that are shown; they are evenly spread over the test part

SpectrumArray = Float[np.ndarray, "90 360"]
Position = Float[np.ndarray, " 3"]
Shared = TypeVar("Shared")


class Spectrum(NamedTuple):
    """A spectrum, and the complex field whose magnitude it is."""

    values: SpectrumArray  # the spectrum, 0…1
    field: Complex[np.ndarray, "90 360"] | None = None  # the field, up to a common factor. None: it is not known.

    @classmethod
    def of(cls, beamformer: Beamformer, responses: Complex[np.ndarray, " elements"]) -> Spectrum:
        """The spectrum of element responses, rounded to eight bits as in a dataset."""
        field = beamformer.steering @ responses
        return cls(spectrum_of(picture(np.abs(field))), field)


@dataclass
class Subject:
    """A run, dataset or scene that the viewer shows, with everything that belongs to it; None for what is missing."""

    name: str  # name of the run, dataset or scene
    # the gateway with the array. If only a run is known, it is at the origin and looks along +z. None: antennas of one
    # element each, which the dataset tells.
    gateway: Gateway | None
    # corners (min, max) of the box of transmitters, metres, world frame. It is the scene's transmitter region,
    # enlarged to contain the dataset's positions.
    region: Float[np.ndarray, "2 3"]
    scene: Scene | None  # the scene
    dataset: Dataset | None  # the dataset
    parts: Split | None  # parts of the dataset: those of the run, or without a run the folder's own
    run: SpectrumRun | None  # the run
    missing: list[str]  # one sentence for each part of the subject that could not be read
    planned: Float[np.ndarray, "n 3"] | None = None  # further positions to show, metres, world frame

    def __post_init__(self) -> None:
        self.alone = RLock()  # all tabs share the model and the fitted methods
        self._shared: dict[Hashable, object] = {}

    def once(self, key: Hashable, make: Callable[[], Shared]) -> Shared:
        """What all tabs share: it is made when the first of them asks for it."""
        with self.alone:
            if key not in self._shared:
                self._shared[key] = make()
            return self._shared[key]  # type: ignore[return-value]

    def fitted(self, quantity: str, method: str) -> Fitted:
        """A method that has learned a quantity at the known positions."""
        assert self.dataset is not None
        return self.once((quantity, method), partial(fit_method, self.dataset, quantity, method, known=self.known))

    @property
    def known(self) -> Int[np.ndarray, " n"]:
        """Indices of the rows that methods learn from."""
        return np.zeros(0, dtype=int) if self.parts is None else self.parts.known

    @cached_property
    def known_region(self) -> Float[np.ndarray, "2 3"] | None:
        """Corners (min, max) of the box of known positions, metres, world frame. None: nothing predicts."""
        if self.dataset is not None and len(self.known):
            return bounding_box(self.dataset.positions[self.known])
        return None if self.run is None else self.run.model.region.double().cpu().numpy()

    @property
    def gateways(self) -> Float[np.ndarray, "G 3"]:
        """Where the gateway is, or the antennas of one element each, metres, world frame."""
        if self.gateway is not None:
            return np.array([self.gateway.position])
        assert self.dataset is not None
        return self.dataset.gateway_positions

    @property
    def traced(self) -> Scene | None:
        """The scene in which rays can be traced from the transmitter to the gateway."""
        return None if self.gateway is None or self.array_moves else self.scene

    @property
    def array_moves(self) -> bool:
        """Whether the positions are those of the array, and the transmitter stands where the gateway is drawn."""
        return self.dataset is not None and self.dataset.moving == "receiver"

    @property
    def wavelength(self) -> float:
        """Wavelength, metres."""
        if self.dataset is not None:
            return self.dataset.wavelength
        if self.run is not None:
            return float(self.run.model.wavelength)
        assert self.scene is not None  # a subject is at least one of the three
        return self.scene.wavelength

    @cached_property
    def beamformer(self) -> Beamformer:
        """Array and grid: those of the run, or else of the dataset, or else the scene's array with the default grid."""
        if self.run is not None:
            return self.run.beamformer
        if self.dataset is not None:
            return self.dataset.beamformer
        assert self.gateway is not None
        return Beamformer(array_of(self.gateway, SPEED_OF_LIGHT / self.wavelength))

    @property
    def propagation(self) -> tuple[Propagation, int]:
        """Propagation settings of the ray tracer and seed of its rays, those with which the dataset was made."""
        metadata = self.dataset.metadata if self.dataset else {}
        return Rays.of(metadata).propagation, seed_of_rays(metadata)

    @property
    def predictors(self) -> dict[str, Callable[[Position], SpectrumArray]]:
        """Functions that predict a spectrum, by name: the run's model and two baselines."""
        predictors: dict[str, Callable[[Position], SpectrumArray]] = {}
        if self.run is not None:
            predictors[self.run.config.model] = self._by_model
        if self.dataset is not None and len(self.known):
            predictors |= {
                "inverse-distance": partial(self._by, inverse_distance),
                "nearest": partial(self._by, nearest),
            }
        return predictors

    def recorded(self, index: int) -> Spectrum:
        """A spectrum of the dataset."""
        assert self.dataset is not None
        recorded = "response" in self.dataset.values
        field = self.beamformer.steering @ self.dataset.responses[index] if recorded else None
        return Spectrum(spectrum_of(self.dataset.pictures[index]), field)

    @property
    def has_primitives(self) -> bool:
        """Whether there is a run whose model has primitives."""
        return self.run is not None and isinstance(self.run.model, HasPrimitives)

    def splats(self, position: Position) -> Splats:
        """The model's primitives for a transmitter position, metres, world frame."""
        assert self.run is not None
        model = self.run.model
        assert isinstance(model, HasPrimitives)
        with self.alone, torch.inference_mode():
            splats = model.splats(torch.from_numpy(position[None]).float().to(model.region.device))
            return Splats(*(each.detach().cpu() for each in splats))

    @property
    def tested(self) -> Int[np.ndarray, " K"]:
        """Indices of the test rows that are shown."""
        return np.zeros(0, dtype=int) if self.parts is None else evenly(self.parts.test, SHOWN)

    @cached_property
    def scores(self) -> Float[np.ndarray, " K"]:
        """SSIM of the first of the ``predictors`` on the spectra ``tested``; empty if there are none."""
        if self.dataset is None or not self.predictors or not len(self.tested):
            return np.zeros(0)
        predict = next(iter(self.predictors.values()))
        prediction = np.stack([predict(position) for position in self.dataset.positions[self.tested]])
        return ssim(prediction, spectrum_of(self.dataset.pictures[self.tested]))

    def field(self, position: Position) -> Complex[np.ndarray, "90 360"] | None:
        """The complex field of the run's prediction, up to a common factor. None: the model has no field."""
        run = self.run
        if run is None:
            return None
        with self.alone, torch.inference_mode():
            model = run.model
            if isinstance(model, HasPrimitives) and not isinstance(model, PredictsResponses):
                field = model.field(torch.from_numpy(position[None]).float().to(model.region.device))
                return torch.view_as_complex(field[0].double().contiguous()).cpu().numpy()
            responses = run.predict(position[None]).responses
            return None if responses is None else run.beamformer.steering @ responses[0]

    def _by_model(self, position: Position) -> SpectrumArray:
        assert self.run is not None
        with self.alone:
            return self.run.predict(position[None]).spectra[0]

    @cached_property
    def _tree(self) -> cKDTree:
        assert self.dataset is not None
        return cKDTree(self.dataset.positions[self.known])

    def _by(self, baseline: Callable[..., np.ndarray], position: Position) -> SpectrumArray:
        """What a baseline predicts from the nearest known spectra, the only ones that it uses."""
        assert self.dataset is not None
        found = self._tree.query(position, k=min(NEIGHBOURS, len(self.known)))[1]
        index = self.known[np.atleast_1d(found)]
        spectra = spectrum_of(self.dataset.pictures[index])
        return baseline(self.dataset.positions[index], spectra, position[None])[0]


def subject(what: str) -> Subject:
    """Read the subject of the viewer."""
    folder = Path(what)
    if not folder.is_dir():
        scene = load_scene(what)
        region = scene.transmitter.region
        return Subject(scene.name, scene.gateway, region, scene, None, None, None, _other_gateways(scene))
    if not (folder / "config.json").exists():
        dataset = read_dataset(folder)
        require_fixed_end(dataset)
        nothing = np.zeros(0, dtype=int)
        every = nothing if len(dataset.test) else np.arange(len(dataset))  # methods learn from all, if none are tested
        parts = Split(train=dataset.train if len(dataset.train) else every, validation=nothing, test=dataset.test)
        return _with_scene(folder.resolve().name, dataset, parts, None)
    run = load_spectra(folder)
    try:
        dataset = run.dataset()
        parts = run.split(dataset)
    except InputError as error:
        region = run.model.region.double().cpu().numpy()
        array = run.beamformer.array
        gateway = Gateway((0, 0, 0), (0, 0, 0, 1), **array.of_gateway())
        missing = [
            f"The dataset of this run cannot be used ({error}), so there are no recorded spectra and no scene. The "
            "gateway is drawn at the origin with its boresight upwards."
        ]
        return Subject(folder.resolve().name, gateway, region, None, None, None, run, missing)
    return _with_scene(folder.resolve().name, dataset, parts, run)


def _with_scene(name: str, dataset: Dataset, parts: Split, run: SpectrumRun | None) -> Subject:
    found = Subject(name, None, bounding_box(dataset.positions), None, dataset, parts, run, [])
    if isinstance(dataset.receiver, ArrayReceiver):
        position, orientation = tuple(dataset.gateway_position), tuple(dataset.gateway_orientation)
        found.gateway = Gateway(position, orientation, **dataset.array.of_gateway())  # type: ignore[arg-type]
    try:
        complete = scene_of(dataset)
        if complete is not None and found.gateway is not None and not found.array_moves:
            found.scene, found.missing = seen_by(dataset, complete), _other_gateways(complete)
            found.gateway = found.scene.gateway
            found.region = bounding_box(np.vstack([found.region, complete.transmitter.region]))
        else:
            found.scene = complete
            found.missing.append("There is no ray tracing: it takes a scene and an array that stands still.")
    except (InputError, OSError) as error:
        found.missing.append(f"The scene of this dataset cannot be read ({error}), so there is no ray tracing.")
    if found.array_moves:
        found.missing.append("The receiver moves: its array is drawn where you move it, the transmitter as a dot.")
    return found


def _other_gateways(scene: Scene) -> list[str]:
    """A sentence that says that other gateways of the scene are not shown; empty if there are none."""
    if not scene.further_gateways:
        return []
    return [f"The scene has {len(scene.by_gateway())} gateways. The viewer shows spectra of the one that is drawn."]
