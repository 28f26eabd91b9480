"""A request to simulate: everything that a dataset's content depends on, and its record in metadata.json."""

from __future__ import annotations

import dataclasses
import hashlib
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from scenes.files.errors import InputError
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.storage.scene_yaml import read_scene
from simulate.dataset.metadata import read_metadata_file
from simulate.fullwave.run_plan import plan
from simulate.fullwave.settings import FullWave
from simulate.positions.given_positions import read_points
from simulate.rays.core.propagation import Propagation
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import beamformer_of
from simulate.spectra.measurement import Measurement

DEFAULT_RAY_SEED = 1
"""Seed of the rays where a dataset does not tell one."""


@dataclass(frozen=True)
class Request:
    """A dataset to simulate.

    Attributes:
        scene: the scene, of one gateway.
        positions: transmitter positions, metres, world frame.
        placement: how they were chosen, for metadata.json: a placement's name and seed, or a CSV.
        propagation: the mechanisms the ray tracer follows.
        seed: seed of the rays and of the 80/20 split of the index files.
        measurement: errors that the receiver adds to the traced responses.
        measurement_seed: seed of these errors.
        power: also write the spectra's absolute power.
        grid: directions of the spectra's rows and columns.
        fullwave: solve Maxwell's equations with these settings instead of tracing rays; None: trace rays.
        field: folder of a full-wave dataset of the same scene, whose stored field is used; None: it is computed.
    """

    scene: Scene
    positions: Float[np.ndarray, "K 3"]
    placement: str
    propagation: Propagation
    seed: int
    measurement: Measurement = dataclasses.field(default_factory=Measurement)
    measurement_seed: int = 0
    power: bool = False
    grid: AngularGrid = dataclasses.field(default_factory=AngularGrid)
    fullwave: FullWave | None = None
    field: Path | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", self.positions.round(6))  # as tx_pos.csv has them

    @property
    def beamformer(self) -> Beamformer:
        """The gateway's array and the grid."""
        return Beamformer(PlanarArray.of(self.scene.gateway), self.grid)

    @property
    def region(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box that all transmitters are in, metres: the scene's region at least."""
        return bounding_box(np.vstack([self.scene.transmitter.region, self.positions]))

    def metadata(self) -> dict[str, Any]:
        """Content of metadata.json: everything that the folder's content depends on."""
        return {
            "made_by": f"bisplat-wrf {version('bisplat-wrf')}",
            "scene": self.scene.name,
            "scene_file": "scene/scene.yaml",
            "scene_sha256": _scene_digest(self.scene),
            "frequency_hz": self.scene.frequency,
            "array": asdict(self.beamformer.array),
            "grid": asdict(self.grid),
            "spectra": len(self.positions),
            "placement": self.placement,
            "positions_sha256": hashlib.sha256(self.positions.tobytes()).hexdigest(),
            **self._engine(),
            "measurement": asdict(self.measurement) | {"seed": self.measurement_seed},
            "power": self.power,
            "seed": self.seed,
            "picture": "magnitude, min-max normalised per spectrum, 8 bit",
            "versions": {name: version(name) for name in self._packages},
        }

    @property
    def _packages(self) -> tuple[str, ...]:
        """Packages that the content depends on."""
        return ("numpy",) if self.fullwave is not None else ("sionna-rt", "mitsuba", "drjit", "numpy")

    def _engine(self) -> dict[str, Any]:
        """The part of the metadata that is the engine's."""
        if self.fullwave is not None:
            planned = plan(self.scene, self.region, self.fullwave.cell)
            window = planned.steps * planned.grid.time_step
            return {
                "engine": "fullwave",
                "fullwave": asdict(self.fullwave) | {"window_ns": round(1e9 * window, 1), "antennas": "short dipoles"},
            }
        return {
            "engine": "rays",
            "propagation": asdict(self.propagation) | {"seed": self.seed},
            "method": "shooting" if self.propagation.sionna else "chains",
        }


def _scene_digest(scene: Scene) -> str:
    """Fingerprint of everything a scene holds, meshes included."""
    digest = hashlib.sha256()
    for item in scene.objects:
        digest.update(f"{item.name} {scene.materials[item.material]} {item.thickness}".encode())
        digest.update(np.ascontiguousarray(item.mesh.vertices).tobytes())
        digest.update(np.ascontiguousarray(item.mesh.faces).tobytes())
    digest.update(f"{scene.frequency} {scene.gateway} {scene.transmitter}".encode())
    return digest.hexdigest()


def propagation_of(metadata: dict[str, Any]) -> tuple[Propagation, int]:
    """How the paths of a dataset were traced.

    Args:
        metadata: content of its metadata.json, checked as ``read_dataset`` does; empty for a dataset that was not
            simulated.

    Returns:
        The mechanisms that were followed and the seed of the rays; the defaults for empty metadata.

    >>> propagation_of({"propagation": {"max_depth": 2, "seed": 4}})[1]
    4
    """
    settings = dict(metadata.get("propagation", {}))
    seed = settings.pop("seed", DEFAULT_RAY_SEED)
    if settings and "slab_phase" not in settings:  # version 0.1
        settings |= {
            "slab_phase": False,
            "sionna": settings.get("diffuse", False) or settings.get("diffraction", False),
        }
    return Propagation(**settings), seed


def read_request(folder: Path) -> Request:
    """The request that a simulated dataset folder was made by, from the folder alone.

    Args:
        folder: the dataset folder.

    Returns:
        The request; its metadata equal those of the folder.

    Raises:
        InputError: no metadata.json of ours, or files that are not those it was made with any more.
    """
    path = folder / "metadata.json"
    if not path.exists() and (folder / "scene.yaml").exists():
        scene_file = folder / "scene.yaml"
        raise InputError(f"{folder}: expected a simulated dataset, found the folder of a scene; give {scene_file}")
    metadata = read_metadata_file(path, "the metadata of a simulated dataset", simulated=True)
    propagation, ray_seed = propagation_of(metadata)
    errors = dict(metadata["measurement"])
    settings: dict[str, Any] = {
        "placement": metadata["placement"],
        "propagation": propagation,
        "seed": metadata["seed"],
        "measurement_seed": errors.pop("seed"),
        "measurement": Measurement(**errors),
        "power": metadata["power"],
    }
    stated = beamformer_of(metadata)
    settings["grid"] = AngularGrid() if stated is None else stated.grid
    if metadata.get("engine") == "fullwave":
        settings["fullwave"] = FullWave(metadata["fullwave"]["cell"], metadata["fullwave"]["solver"])
    if metadata.get("engine") != "fullwave" and ray_seed != metadata["seed"]:
        raise InputError(
            f"{path}: expected the dataset's seed {metadata['seed']} as propagation.seed, found {ray_seed}"
        )
    request = Request(read_scene(folder / metadata["scene_file"]), read_points(folder / "tx_pos.csv"), **settings)
    for key, value in request.metadata().items():
        if key.endswith("sha256") and value != metadata[key]:
            raise InputError(f"{path}: expected the files the dataset was made with, found another {key[:-7]}")
    return request
