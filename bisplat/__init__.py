"""The Python interface of bisplat-wrf: ray-trace datasets of spectra, train models on them, and score the models.

>>> import bisplat
>>> scene = bisplat.load_scene("bedroom")
>>> coarse = bisplat.Propagation(max_depth=1, rays=20_000)
>>> dataset = bisplat.simulate(scene, "data/bedroom", n=20, seed=0, propagation=coarse)
>>> run = bisplat.train(dataset, "runs/bedroom", model="helmholtz", split="random")
>>> run.predict(dataset.positions[:3]).spectra.shape
(3, 90, 360)

Each name is imported when it is first used, so that ``import bisplat`` loads neither torch nor the ray tracer.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bisplat.own_packages import claim

claim()

if TYPE_CHECKING:  # for type checkers and editors; at run time __getattr__ imports from the same modules
    from learn.comparison.ablate import ablate as ablate
    from learn.comparison.compare import compare as compare
    from learn.comparison.sweep import sweep as sweep
    from learn.evaluation.check import check as check
    from learn.evaluation.crossvalidate import crossvalidate as crossvalidate
    from learn.evaluation.evaluate import evaluate as evaluate
    from learn.localisation.locate import locate as locate
    from learn.planning.next_positions import plan as plan
    from learn.training.model_export import export as export
    from learn.training.run_folder import load_run as load_run
    from learn.training.train import train as train
    from learn.twin.calibrate import calibrate as calibrate
    from scenes.files.errors import InputError as InputError
    from scenes.importing.mesh_import import import_scene as import_scene
    from scenes.scene.description import Gateway as Gateway
    from scenes.scene.description import Scene as Scene
    from scenes.scene.description import SceneObject as SceneObject
    from scenes.scene.description import Transmitter as Transmitter
    from scenes.scene.tolerances import Tolerances as Tolerances
    from scenes.storage.scene_yaml import load_scene as load_scene
    from scenes.storage.scene_yaml import write_scene as write_scene
    from simulate.dataset.dataset_folder import read_dataset as read_dataset
    from simulate.exchange.deepmimo.deepmimo_export import export_deepmimo as export_deepmimo
    from simulate.exchange.hdf5_export import export_hdf5 as export_hdf5
    from simulate.generation.simulation import simulate as simulate
    from simulate.rays.core.propagation import Propagation as Propagation
    from simulate.rays.tracer import Tracer as Tracer
    from simulate.spectra.angular_grid import AngularGrid as AngularGrid
    from simulate.spectra.array import PlanarArray as PlanarArray
    from simulate.spectra.beamformer import Beamformer as Beamformer
    from simulate.spectra.lags import fit_lags as fit_lags
    from simulate.spectra.measurement import Measurement as Measurement
    from simulate.spectra.phase_retrieval import retrieve_responses as retrieve_responses

_HOMES = {
    "scenes.scene.description": ("Gateway", "Scene", "SceneObject", "Transmitter"),
    "scenes.files.errors": ("InputError",),
    "scenes.storage.scene_yaml": ("load_scene", "write_scene"),
    "scenes.scene.tolerances": ("Tolerances",),
    "scenes.importing.mesh_import": ("import_scene",),
    "simulate.spectra.angular_grid": ("AngularGrid",),
    "simulate.spectra.array": ("PlanarArray",),
    "simulate.spectra.beamformer": ("Beamformer",),
    "simulate.dataset.dataset_folder": ("read_dataset",),
    "simulate.exchange.deepmimo.deepmimo_export": ("export_deepmimo",),
    "simulate.exchange.hdf5_export": ("export_hdf5",),
    "simulate.spectra.lags": ("fit_lags",),
    "simulate.spectra.measurement": ("Measurement",),
    "simulate.spectra.phase_retrieval": ("retrieve_responses",),
    "simulate.rays.core.propagation": ("Propagation",),
    "simulate.generation.simulation": ("simulate",),
    "simulate.rays.tracer": ("Tracer",),
    "learn.training.train": ("train",),
    "learn.training.run_folder": ("load_run",),
    "learn.evaluation.check": ("check",),
    "learn.evaluation.evaluate": ("evaluate",),
    "learn.evaluation.crossvalidate": ("crossvalidate",),
    "learn.comparison.compare": ("compare",),
    "learn.comparison.ablate": ("ablate",),
    "learn.comparison.sweep": ("sweep",),
    "learn.training.model_export": ("export",),
    "learn.localisation.locate": ("locate",),
    "learn.planning.next_positions": ("plan",),
    "learn.twin.calibrate": ("calibrate",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'bisplat' has no attribute {name!r}")
    value = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
