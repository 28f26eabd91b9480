"""A request for a simulation: everything that the content of a dataset depends on, and its record in metadata.json."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from scenes.files.errors import InputError, shown
from scenes.scene.description import Scene, with_same_array
from scenes.scene.shapes import bounding_box
from scenes.storage.scene_digest import scene_digest
from scenes.storage.scene_yaml import read_scene
from simulate.dataset.dataset_kinds import Moving, require_spectra
from simulate.dataset.metadata import band_of, read_metadata_file
from simulate.engines.engine import Engine, ResponseSource, Setting
from simulate.engines.engine_table import engine_of
from simulate.engines.rays_engine import Rays, seed_of_rays
from simulate.generation.reciprocity import MovingArray, element_offsets, reciprocal
from simulate.positions.placement import AT_IT
from simulate.positions.positions import points_digest, read_points
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.band import Band
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import array_of
from simulate.spectra.identification import stated_grid
from simulate.spectra.measurement import Measurement

TEST_FRACTION = 0.2  # Share of the spectra in test_index.txt


@dataclass(frozen=True)
class Request:
    scene: Scene  # the scene, with one gateway
    # places of the end that moves, metres, world frame; if both move, those of the transmitter
    positions: Float[np.ndarray, "K 3"]
    placement: str  # how the positions were chosen, for metadata.json: name and seed of a placement, or name of a CSV
    engine: Engine  # computes the responses, with its options for this scene
    seed: int  # seed of the engine, and of the 80/20 split in the index files
    measurement: Measurement = Measurement()  # errors that the receiver adds to the responses
    measurement_seed: int = 0  # seed of these errors
    power: bool = False  # also write the absolute power of the spectra
    grid: AngularGrid = dataclasses.field(default_factory=AngularGrid)  # directions of the spectra's rows and columns
    band: Band | None = None  # subcarriers whose responses are also written. None: only those of the carrier.
    # frequencies at which each position is simulated, Hz, rising. Empty: that of the scene.
    frequencies: tuple[float, ...] = ()
    moving: Moving = "transmitter"  # whether the transmitter, the receiver or both move
    # if both move, the middle of the array for each position, metres, world frame; otherwise None
    receivers: Float[np.ndarray, "K 3"] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", self.positions.round(6))  # as tx_pos.csv has them
        if self.receivers is not None:
            object.__setattr__(self, "receivers", self.receivers.round(6))

    @property
    def beamformer(self) -> Beamformer:
        return Beamformer(array_of(self.scene.gateway, self.scene.frequency), self.grid)

    def __len__(self) -> int:
        """Number of spectra: all positions at the first frequency, then all at the next one, and so on."""
        return len(self.positions) * max(1, len(self.frequencies))

    @cached_property
    def scenes(self) -> list[Scene]:
        """The scene at each frequency, with an array of the same size in metres."""
        if not self.frequencies:
            return [self.scene]
        return [with_same_array(self.scene, frequency) for frequency in self.frequencies]

    def of_array(self, sources: Sequence[Sequence[ResponseSource]]) -> list[ResponseSource]:
        """What computes the responses of the array at each frequency, from what the engine's ``sources`` returned."""
        if self.moving != "transmitter":
            return [MovingArray(self.transmitters, each, self.offsets) for each in zip(*sources, strict=True)]
        (at_frequencies,) = sources
        return list(at_frequencies)

    @cached_property
    def transmitters(self) -> Float[np.ndarray, "N 3"]:
        """The different places of the transmitter, metres, world frame, if the array moves."""
        return np.unique(self.places[:, :3], axis=0)

    @cached_property
    def places(self) -> Float[np.ndarray, "K coordinates"]:
        """What a source computes responses of: positions, [K, 3], or those of transmitter and array, [K, 6]."""
        if self.moving == "transmitter":
            return self.positions
        if self.receivers is not None:
            return np.hstack([self.positions, self.receivers])
        return np.hstack([np.tile(self.scene.gateway.position, (len(self.positions), 1)), self.positions])

    @property
    def offsets(self) -> Float[np.ndarray, "antennas 3"]:
        """Where the antennas that move are from a position, metres, world frame."""
        return AT_IT if self.moving == "transmitter" else element_offsets(self.scene.gateway, self.scene.wavelength)

    @property
    def held_out(self) -> Int[np.ndarray, " t"]:
        """Indices of the spectra in test_index.txt, in rising order. Their positions are drawn with the seed."""
        count = len(self.positions)
        drawn = np.random.default_rng(self.seed).permutation(count)[: max(1, round(TEST_FRACTION * count))]
        return (np.sort(drawn) + count * np.arange(len(self.scenes))[:, None]).ravel()

    @property
    def known(self) -> Int[np.ndarray, " n"]:
        """Indices of the spectra in train_index.txt: all others, in rising order."""
        return np.setdiff1d(np.arange(len(self)), self.held_out)

    @property
    def settings(self) -> list[Setting]:
        """Scenes, region and seed for the engine, for each antenna or array that stands still in its simulations."""
        stand = [self.scenes]
        if self.moving != "transmitter":
            stand = [[reciprocal(each, place) for each in self.scenes] for place in self.transmitters.tolist()]
        moved = self.positions if self.receivers is None else self.receivers
        antennas = (moved[:, None] + self.offsets).reshape(-1, 3)
        region = bounding_box(np.vstack([stand[0][0].transmitter.region, antennas]))
        return [Setting(scene, region, self.seed, self.band, tuple(further)) for scene, *further in stand]

    @property
    def setting(self) -> Setting:
        """The first of ``settings``, which is the only one unless both ends move."""
        return self.settings[0]

    def metadata(self) -> dict[str, Any]:
        """Content of metadata.json: everything that the content of the folder depends on."""
        return {
            "made_by": f"bisplat-wrf {version('bisplat-wrf')}",
            "scene": self.scene.name,
            "scene_file": "scene/scene.yaml",
            "scene_sha256": scene_digest(self.scene),
            "frequency_hz": self.scene.frequency,
            **({"frequencies_hz": list(self.frequencies)} if self.frequencies else {}),
            **({} if self.moving == "transmitter" else {"moving": self.moving}),
            "array": self.beamformer.array.stated(),
            "grid": asdict(self.grid),
            **({} if self.band is None else {"band": asdict(self.band)}),
            "spectra": len(self),
            "placement": self.placement,
            "positions_sha256": points_digest(self.positions),
            **({} if self.receivers is None else {"receivers_sha256": points_digest(self.receivers)}),
            **self.engine.metadata(self.setting),
            "measurement": asdict(self.measurement) | {"seed": self.measurement_seed},
            "power": self.power,
            "seed": self.seed,
            "picture": "magnitude, min-max normalised per spectrum, 8 bit",
            "versions": self.engine.versions(),
        }


def read_request(folder: Path) -> Request:
    """Read the request that a simulated dataset folder was made by from the folder itself."""
    path = folder / "metadata.json"
    if not path.exists() and (folder / "scene.yaml").exists():
        scene_file = folder / "scene.yaml"
        raise InputError(f"{folder}: expected a simulated dataset, found the folder of a scene; give {scene_file}")
    require_spectra(folder)
    metadata = read_metadata_file(path, "the metadata of a simulated dataset", simulated=True)
    errors = dict(metadata["measurement"])
    measurement_seed = errors.pop("seed")
    frequencies, moving = tuple(metadata.get("frequencies_hz", ())), metadata.get("moving", "transmitter")
    positions = read_points(folder / "tx_pos.csv")
    receivers = read_points(folder / "rx_pos.csv") if moving == "both" else None
    if frequencies:  # tx_pos.csv and rx_pos.csv repeat the places at each of them
        count = len(positions) // len(frequencies)
        positions, receivers = positions[:count], None if receivers is None else receivers[:count]
    request = Request(
        scene=read_scene(folder / metadata["scene_file"]),
        positions=positions,
        placement=metadata["placement"],
        engine=engine_of(metadata),
        seed=metadata["seed"],
        measurement=Measurement(**errors),
        measurement_seed=measurement_seed,
        power=metadata["power"],
        grid=stated_grid(metadata) or AngularGrid(),
        band=band_of(metadata),
        frequencies=frequencies,
        moving=moving,
        receivers=receivers,
    )
    found = seed_of_rays(metadata)
    if isinstance(request.engine, Rays) and found != request.seed:
        raise InputError(f"{path}: expected propagation.seed to be the seed {request.seed}, found {found}")
    made = request.metadata()
    for key in sorted(each for each in made.keys() | metadata.keys() if each.endswith("sha256")):
        if made.get(key) != metadata.get(key):
            what = key.removesuffix("_sha256")
            raise InputError(f"{path}: expected the {what} that the dataset was made with, found a change")
    for key in ("frequency_hz", "array"):
        if made[key] != metadata.get(key, made[key]):
            stored = shown(metadata[key])
            raise InputError(f"{path}: {key}: expected {made[key]}, as in {metadata['scene_file']}, found {stored}")
    return request
