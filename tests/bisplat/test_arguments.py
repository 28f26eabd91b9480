"""Wrong arguments of every public function, class and method are refused at once, and nothing is written."""

import inspect
import re
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bisplat
from simulate.positions.positions import write_positions
from tests.folders import write_links

AT_ONCE = 2.0
"""Seconds that a refusal may take. It may read a small dataset, but neither train nor trace."""

NAN, INF = float("nan"), float("inf")
WHOLE = (1.5, "3", True, 0, -1, NAN, None, np.array([1, 2]))
SEED = (1.5, "3", True, -1, 2**32, None, np.array([1, 2]))
FLAG = ("no", 1, None, np.array([True]))
NUMBER = ("3", NAN, INF, 1j, True, np.array([1.0, 2.0]))
BANDWIDTH = (0, NAN, "x", 1j, True, np.array([1.0, 2.0]))
WORD = ("x", 3, None, ["files"])
OBJECT = ("x", 3, {}, np.zeros(3))
PATH = (5, 1.5, ["a"], {}, "")
MASKED = np.ma.masked_array([[1.0, 2, 3]], mask=[[1, 0, 0]])
POINTS = (
    "x", None, 3, [], [1.0, 2, 3], [[1.0, 2]], [[1.0, 2, NAN]], [[1.0, 2, INF]], [["1", "2", "3"]], [[1, 2, 3 + 1j]],
    [[True, False, True]], [[1e9, 0, 0]], [[1, 2, 3], [1, 2]], MASKED, np.array([[None, None, None]]), {"x": 1},
)  # fmt: skip
NOT_NEGATIVE = (*NUMBER, -1, None)
POINT = ("x", None, 3, [1.0, 2], [1.0, 2, NAN], ["1", "2", "3"], [1, 2, 3j], [[1, 2, 3]], MASKED[0])
CORNERS = (*POINT, [[0, 0, 0]], [[0, 0, NAN], [1, 1, 1]])
SPECTRA = (
    "x", None, 3, np.zeros((45, 360)), np.zeros((90, 360), np.uint8), np.zeros((90, 360), complex),
    np.ma.zeros((90, 360)), [[1.0], [1.0, 2.0]],
)  # fmt: skip
STACK = (*SPECTRA, np.zeros((90, 360)), np.zeros((0, 90, 360)), np.full((1, 90, 360), NAN))
RESPONSES = ("x", None, 3, np.zeros(15), np.full(16, "1"), np.ma.zeros(16), np.zeros(16, bool))
ANGLES = ("x", None, NAN, [NAN], 1j, np.ma.zeros(3), [True])
NAMES = ("nearest", 3, [], ["nearst"], [3], np.ones(3), None)

COMMON: dict[str, Any] = {
    "seed": SEED, "positions": POINTS, "scene": OBJECT, "folder": PATH, "output": PATH, "propagation": OBJECT,
    "guard": (*NUMBER, -1), "split": WORD, "budget": (*NUMBER, 0, -1), "methods": NAMES[:6], "seeds": WHOLE, "n": WHOLE,
    "array": OBJECT, "grid": OBJECT, "force": FLAG, "tolerances": OBJECT, "placement": WORD, "gpu": FLAG, "field": PATH,
    "spectra": STACK, "train_size": (*WHOLE[:6], [], [2, 2], [0]), "difference": FLAG, "ax": OBJECT, "truth": SPECTRA,
    "beamformer": (*OBJECT, None), "frequency": (*NUMBER, 0, 2.4), "method": WORD, "path": PATH, "azimuth": ANGLES,
    "moving": (*WORD, "both"), "dataset": (*PATH, "nowhere"), "run": (*PATH, "nowhere"), "position": POINT,
    "spectrum": SPECTRA, "prediction": SPECTRA, "responses": RESPONSES, "elevation": [*ANGLES, [1.0] * 3],
    "bandwidth": (*BANDWIDTH, 1e6), "receivers": [*POINTS[2:], [[1, 0, 1]] * 2], "u": (*ANGLES[:4], [1.0, 2.0]),
    "v": (*ANGLES[:4], [1.0, 2.0]), "rotation": NOT_NEGATIVE, "objects": NOT_NEGATIVE, "carrier": NOT_NEGATIVE,
    "gain_error_db": NOT_NEGATIVE, "phase_error_deg": NOT_NEGATIVE, "phase_noise_deg": NOT_NEGATIVE,
    "shadowing_db": NOT_NEGATIVE, "quantisation_db": NOT_NEGATIVE,
}  # fmt: skip
"""Wrong values of parameters that many functions have."""

OF_TYPES: dict[str, tuple] = {
    "bool": FLAG, "int": WHOLE, "float": (*NUMBER, None), "Vector3": POINT, "Sequence[float]": POINT, "Path": PATH,
    "Quaternion": ("x", None, (0, 0, 1), (0, 0, 0, "1")), "Scene | str": OBJECT, "Gateway": (*OBJECT, None),
    "Transmitter": (*OBJECT, None), "CoverageMap": OBJECT, "Measurement": OBJECT, "Trimesh": OBJECT,
}  # fmt: skip
"""Wrong values of other parameters, by how their declared types begin."""


def of_type(parameter: inspect.Parameter) -> tuple:
    declared = re.sub(r"^(Annotated\[|<class '([a-z_]+\.)*)", "", str(parameter.annotation))
    values = next((each for word, each in OF_TYPES.items() if declared.startswith(word)), ())
    return tuple(each for each in values if each is not None) if "None" in declared else values


IDLE_IN_LOCATE = {
    "split": ("random",), "level": (1.0,), "region": (np.eye(2, 3),), "boresight": ((1, 0, 0),), "frequency": (9e8,),
    "round_trip": (True,),
}  # fmt: skip
"""Values of options of ``locate`` that do nothing with some kinds of what is known."""


@dataclass(frozen=True)
class Call:
    """A public callable with valid arguments, and values that it must refuse, by parameter."""

    function: Callable[..., Any]  # the callable
    valid: dict[str, Any] = field(default_factory=dict)  # its arguments, of which one at a time is replaced
    own: dict[str, Any] = field(default_factory=dict)  # the values, where they are not those of ``COMMON``
    exempt: dict[str, str] = field(default_factory=dict)  # parameters that are not checked, with the reason

    @property
    def wrong(self) -> dict[str, Any]:
        """The values that it must refuse."""
        parameters = inspect.signature(self.function).parameters
        usual = {name: COMMON.get(name) or of_type(each) for name, each in parameters.items()}
        return {name: each for name, each in usual.items() if each and name not in {*self.exempt, "report"}} | self.own


ANYWHERE = POINT[:4] + POINT[5:]


def calls(run: bisplat.Run, data: Path, scene: bisplat.Scene, file: Path) -> dict[str, Call]:
    """Every public callable, by its name in ``bisplat``; ``file`` is a mesh."""
    dataset, spectrum = bisplat.read_dataset(data), np.zeros((90, 360))
    pair = {"prediction": spectrum, "truth": spectrum}
    tracer = bisplat.Tracer(scene, bisplat.Propagation(max_depth=0, diffraction=False, rays=100))
    circle = bisplat.ElementArray.circle(8, 0.1).at(915e6)
    array, grid, beamformer = bisplat.PlanarArray(), bisplat.AngularGrid(), bisplat.Beamformer()
    mesh = bisplat.shapes.box((0, 0, 0), (1, 1, 1))
    material = {"name": "tile", "relative_permittivity": 6.5, "conductivity": 0.02, "thickness": 0.01}
    between = {"u": [0.0, 0.0, 1.0], "v": [0.0, 1.0, 0.0]}
    positions = {"positions": [[0.9, 1.3, 1.1]]}
    no_grid = {"grid": (*OBJECT, None)}
    powers, links = file.with_name("powers"), file.with_name("links")
    other = (*PATH, "nowhere", data)
    two = {"positions": [[1, 0, 1], [2, 0, 1]]}
    return {
        "load_scene": Call(bisplat.load_scene, {}, {"name_or_path": ("x", 3, None, "x.yaml")}),
        "import_scene": Call(
            bisplat.import_scene,
            {"path": file, "gateway": scene.gateway, "transmitter": scene.transmitter, "default_material": "wood"},
            {
                "path": (*PATH, "nowhere.ply"), "materials": ("Wall=wood", 3, None, ["x"], [("x",)], [("*", 3)]),
                "default_material": ("x", 3, [], {}), "unit": WORD, "up": WORD[:2], "frequency": (*NUMBER, 0, None),
                "walls": WORD, "own_materials": ("x", 3, [], {"wood": 3}, {3: scene.materials["concrete"]}),
            },
        ),
        "read_dataset": Call(bisplat.read_dataset, {"folder": data}, {"folder": other[:-1], "frequency": BANDWIDTH}),
        "write_dataset": Call(
            bisplat.write_dataset,
            two | {"folder": "out", "responses": np.ones((2, 16)) * (1 + 1j), "array": array, "frequency": 915e6},
            {
                "responses": ("x", 3, None, np.ones((2, 16))), "phases": WORD, "spectra": ("x", 3),
                "powers": ([[-50.0]],), "channels": (np.ones((2, 1, 4)) * 1j,), "gateways": ({},), "antennas": (3,),
            },
        ),
        "Band": Call(bisplat.Band, {"bandwidth": 20e6, "subcarriers": 64}, {"bandwidth": (*NUMBER, 0)}),
        "Band.frequencies": Call(bisplat.Band(20e6, 64).frequencies, {}, {"carrier": (*NUMBER, 0)}),
        "write_dataset.powers": Call(
            bisplat.write_dataset,
            two | {
                "folder": "out", "powers": [[-50.0], [-60.0]], "gateways": {"door": (0, 0, 1)}, "frequency": 2.4e9,
            },
            {
                "powers": ("x", None, 3, [[-50.0, -60.0]], [[1e-5], [1e-6]], [[50.0], [60.0]], [[INF], [-60.0]]),
                "gateways": ("x", None, {}, [(0, 0, 1)], {3: (0, 0, 1)}, *({"door": each} for each in POINT)),
                "floor_dbm": (*NUMBER, -101, 61, None), "array": (array,), "antennas": (3,),
                "responses": (3,), "spectra": (3,), "channels": (3,), "phases": WORD,
            },
        ),
        "write_dataset.channels": Call(
            bisplat.write_dataset,
            {
                "folder": "out", "positions": None, "channels": np.ones((2, 1, 4)) * 1j, "antennas": [[0, 0, 1]],
                "frequency": 2.4e9,
            },
            {
                "channels": ("x", None, 3, np.ones((2, 2, 4)) * 1j, np.ones((2, 1, 3)) * 1j), "gateways": ({},),
                "antennas": ("x", None, 3, [(0, 0, 1)] * 2), "bandwidth": BANDWIDTH,
                "positions": ("x", 3), "responses": (3,), "spectra": (3,), "powers": (3,), "phases": WORD,
                "floor_dbm": (-60,), "array": (array,),
            },
        ),
        "write_dataset.spectra": Call(
            bisplat.write_dataset,
            two | {"folder": "out", "spectra": dataset.spectra[:2], "frequency": 2.4e9},
            {
                "spectra": ("x", None, 3, dataset.spectra, 2 * dataset.spectra[:2]), "floor_dbm": (-60,),
                "gateways": ({},), "antennas": (3,), "responses": (3,), "powers": (3,), "channels": (3,),
                "phases": WORD,
            },
        ),
        "simulate_rooms": Call(
            bisplat.simulate_rooms,
            {"output": "out", "n": 1, "spectra": 2},
            {
                "setting": WORD, "spectra": WHOLE[:7], "shape": WORD,
                "pieces": (3, "x", None, (1,), (1, 2, 3), (-1, 3), (0, 13), (3, 2), (1.5, 3)),
            },
            {"options": "those of simulate"},
        ),
        "simulate_rssi": Call(
            bisplat.simulate_rssi,
            {"scene": scene, "folder": "out", "gateways": {"door": (2.0, 0.5, 1.8)}, "n": 2},
            {
                "gateways": (
                    "nowhere.yml", None, 3, {}, [(0, 0, 1)], {3: (0, 0, 1)}, {"door": (0, 0, -9e9)},
                    {"door": bisplat.Gateway((2.0, 0.5, 1.8), (0, 0, 0, 1), pattern="x")},
                    *({"door": each} for each in POINT),
                ),
                "n": (*WHOLE, 1), "positions": [*POINTS[2:], "nowhere.csv"], "tx_power_dbm": (*NUMBER, 61, None),
                "floor_dbm": (*NUMBER, -101, None), "wrong": (1,),
            },
        ),
        "load_run": Call(bisplat.load_run, {}, {"folder": (*PATH, "nowhere")}),
        "check": Call(bisplat.check, {"folder": data, "split": "random"}, {"split": ("x", 3, ["files"])}),
        "simulate": Call(
            bisplat.simulate,
            {"scene": scene, "output": "out", "n": 2},
            {
                "n": (*WHOLE, 1), "engine": WORD, "positions": [*POINTS[2:], "nowhere.csv"], "workers": WHOLE[:6],
                "cell": NUMBER[:4], "wrong": (1,), "subcarriers": (0, 2, "x"), "transmitters": (*WHOLE[:6], 2),
                "frequencies": (3, (2.4,), ("x",), (1e9, 1e9)), "receivers": [*POINTS[2:], "nowhere.csv"],
            },
            {"ray": "an address, which Ray must answer", "solver": "set by the engine"},
        ),
        "Rays": Call(bisplat.Rays),
        "FullWave": Call(bisplat.FullWave, {}, {"cell": (*NUMBER, 0)}, {"solver": "set by the engine"}),
        "Propagation": Call(bisplat.Propagation, {}, {"max_depth": (*WHOLE[:3], -1, 31, None)}),
        "Measurement": Call(bisplat.Measurement),
        "Measurement.apply": Call(
            bisplat.Measurement(snr_db=20).apply,
            {"responses": np.ones((2, 16), complex), "numbers": np.arange(2), "seed": 0},
            {"responses": [*RESPONSES, np.full((2, 16), NAN)], "numbers": ("x", [0], [0, NAN], None)},
        ),
        "Tolerances": Call(bisplat.Tolerances, {}, {"position": NOT_NEGATIVE, "materials": NOT_NEGATIVE}),
        "Tracer": Call(
            bisplat.Tracer,
            {"scene": scene, "propagation": tracer.ray_scene.propagation},
            {"region": CORNERS[:1] + CORNERS[2:]},
            {"found": "from another tracer"},
        ),
        "Tracer.responses": Call(
            tracer.responses,
            positions,
            {"factors": ("x", np.ones(tracer.chains + 1), np.full(tracer.chains, NAN))},
        ),
        "Tracer.responses_by_chain": Call(tracer.responses_by_chain),
        "Tracer.responses_with": Call(
            tracer.responses_with,
            {"others": [scene]} | positions,
            {"others": (*OBJECT, None, scene, [], ["closet"])},
        ),
        "Tracer.band_responses": Call(
            tracer.band_responses,
            {"band": bisplat.Band(20e6, 4)} | positions,
            {"band": (*OBJECT, bisplat.Band(500e6, 4))},
        ),
        "Tracer.at_frequency": Call(tracer.at_frequency),
        "Tracer.middle_by_chain": Call(tracer.middle_by_chain),
        "Tracer.paths": Call(tracer.paths),
        "PlanarArray": Call(
            bisplat.PlanarArray,
            {},
            {"rows": (*WHOLE, 65), "columns": (*WHOLE, 65), "spacing": (*NUMBER, 0, -1, None)},
        ),
        "PlanarArray.at": Call(array.at),
        "ElementArray": Call(
            bisplat.ElementArray,
            {"positions_m": [[0, 0, 0], [0.1, 0, 0]]},
            {"positions_m": [*POINTS[2:], [], [[0, 0, 0]] * 2, [[101, 0, 0]]], "frequency": (*NUMBER[:4], 0, 2.4)},
        ),
        "ElementArray.circle": Call(
            bisplat.ElementArray.circle,
            {"elements": 8, "radius_m": 0.1},
            {"elements": (*WHOLE, 1025), "radius_m": (*NUMBER, 0, -1, 101)},
        ),
        "ElementArray.at": Call(circle.at),
        "ElementArray.manifold": Call(circle.manifold, {"azimuth": [0.0, 1.0], "elevation": 0.5}),
        "ElementArray.angle_between": Call(circle.angle_between, between),
        "PlanarArray.manifold": Call(array.manifold, {"azimuth": [0.0, 1.0], "elevation": 0.5}),
        "PlanarArray.angle_between": Call(array.angle_between, between),
        "AngularGrid": Call(
            bisplat.AngularGrid,
            {},
            {name: (*NUMBER, 0, None) for name in ("elevation_step_deg", "azimuth_step_deg")},
        ),
        "AngularGrid.dominant_angles": Call(grid.dominant_angles, {}, {"spectrum": SPECTRA[:4]}),
        "AngularGrid.dominant_direction": Call(grid.dominant_direction, {}, {"spectrum": SPECTRA[:4]}),
        "Beamformer": Call(bisplat.Beamformer),
        "Beamformer.spectrum": Call(beamformer.spectrum),
        "Beamformer.power_db": Call(beamformer.power_db),
        "ssim": Call(bisplat.ssim, pair, {"prediction": [*SPECTRA, np.zeros((2, 90, 360))]}),
        "aoa_error": Call(bisplat.aoa_error, pair, no_grid | {"array": (*OBJECT, None)}),
        "plot_spectrum": Call(bisplat.plot_spectrum, {"spectrum": spectrum}, no_grid),
        "train": Call(
            bisplat.train,
            {"dataset": data, "output": "out", "model": "mlp"},
            {
                "model": WORD, "quantity": WORD[:2], "options": ("x", 3, {"wrong": 1}, {"pixels": object()}),
                "steps": WHOLE[:6],
                "batch_size": WHOLE[:6], "patience": (1.5, -1), "preset": WORD[:2], "learning_rate": (*NUMBER, 0),
                "weight_decay": (*NUMBER, -1), "full_resolution": (*NUMBER, 2), "matmul_precision": WORD[:2],
                "find_phases": FLAG[:1], "init": PATH, "trainer": ("x", {"devices": 0}, {"wrong": 1}), "wrong": (1,),
            },
        ),
        "score": Call(bisplat.score, pair),
        "Dataset.torch": Call(
            dataset.torch, {}, {"rows": ("x", 3, [0.5], [True], [-1], [10**9], [[0]], [[0], [0, 1]], {})}
        ),
        "split": Call(
            bisplat.split,
            {"dataset": dataset, "kind": "files", "seed": 0},
            {"dataset": (*OBJECT, "x"), "kind": WORD, "train_size": WHOLE[:6]},
        ),
        "evaluate": Call(bisplat.evaluate, {"run": run}, {"index": (*PATH, "nowhere")}),
        "crossvalidate": Call(
            bisplat.crossvalidate,
            {"run": run, "scene": scene},
            {"positions": WHOLE, "engine": (*OBJECT, "ray"), "field": (*PATH, "nowhere")},
        ),
        "compare": Call(
            bisplat.compare,
            {"data": powers, "methods": ["mean"], "split": "random"},
            {
                "data": other, "methods": NAMES[:6], "quantity": WORD[:2], "sizes": ("5", 5, [], [5, 5], [0], [1.5]),
                "tested": WHOLE[:5], "steps": WHOLE[:5], "test_rooms": (), "init": (*PATH, "x"),
                "scene": (3, True, "nowhere", [], {"x": 1}),
            },
        ),
        "coverage_map": Call(
            bisplat.coverage_map,
            {"powers": powers, "method": "mean"},
            {
                "powers": (*PATH[:4], "nowhere", data), "height": (*NUMBER, 1e9),
                "step": (*NUMBER, 0, -1, None, 1e-09),
                "region": ("x", 3, [], [0, 0, 1], [0, 0, 0, 1], [1, 0, 0, 1], [0, 0, NAN, 1], [0, 0, 1, 1e9], {"x": 1}),
            },
        ),
        "variants": Call(bisplat.variants, {"models": ["bisplat"]}, {"models": NAMES, "primitives": WHOLE[:6]}),
        "locate": Call(
            bisplat.locate,
            {"model_or_dataset": [run], "heard": [dataset.pictures[:1]]},
            IDLE_IN_LOCATE
            | {
                "model_or_dataset": ("x", None, [], ["x"], [run, run], POINTS[0]),
                "heard": (
                    "x", [], dataset.pictures[:1], [dataset.pictures[0]], [dataset.pictures[:1, :45]],
                    [dataset.pictures[:0]], [dataset.pictures[:1]] * 2, [np.ma.masked_array(dataset.pictures[:1])],
                    [dataset.pictures[:1].astype(complex)],
                ),
            },
        ),
        "locate by powers": Call(
            bisplat.locate,
            {"model_or_dataset": powers, "heard": [[-60.0]]},
            IDLE_IN_LOCATE
            | {
                "model_or_dataset": other,
                "heard": (
                    "x", [], [-60.0], [[-60.0, -50.0]], [[INF]], [[90.0]], [[1e-6]], [[1j]], [[1], [1, 2]],
                    np.ma.masked_array([[-60.0]]),
                ),
                "level": ("x", NAN, 100, [1.0]), "split": ("random",),
            },
        ),
        "locate by channels": Call(
            bisplat.locate,
            {"model_or_dataset": file.with_name("placed_links"), "heard": np.ones((1, 2, 4))},
            IDLE_IN_LOCATE
            | {
                "model_or_dataset": (*other, links),
                "heard": (
                    "x", [], np.ones((2, 4)), np.ones((1, 4, 2)), np.full((1, 2, 4), NAN), [[1], [1, 2]],
                    np.ma.masked_array(np.ones((1, 2, 4))),
                ),
            },
        ),
        "locate by a track": Call(
            bisplat.locate,
            {
                "model_or_dataset": np.eye(5, 3), "heard": np.ones((1, 5), complex), "frequency": 9e8,
                "region": [[0, 1, 0], [1, 2, 0]],
            },
            IDLE_IN_LOCATE
            | {
                "model_or_dataset": POINTS,
                "heard": ("x", None, [], np.ones((1, 4), complex), np.ones(5, complex)), "round_trip": ("x",),
                "frequency": ("x", None, 0, -1, NAN), "boresight": ("x", [1, 2], [0, 0, 0], [NAN] * 3),
                "region": ("x", None, [], [[0, 1, 0]], [[1, 1, 0], [0, 2, 0]], [[0, 1, NAN], [1, 2, 0]]),
            },
        ),
        "plan": Call(
            bisplat.plan,
            {"run_or_scene": run, "n": 2},
            {
                "run_or_scene": OBJECT, "n": (*(each for each in WHOLE if each is not None), 1001),
                "target": ("0.9", True, 0, 1.5, -1, NAN, [0.9]),
            },
        ),
        "calibrate": Call(bisplat.calibrate, {"scene": scene, "dataset": data}),
        "export": Call(
            bisplat.export,
            {"source": run, "output": "a.onnx"},
            {"source": (*OBJECT, dataset), "output": (*PATH, "a.txt"), "format": (*WORD[:2], "csi"), "scene": ()},
        ),
        "Run.predict": Call(run.predict, {"positions": [[1.0, 2, 3]]}, {"dtype": (*WORD, "float64", np.int8)}),
        "Run.deviation": Call(run.deviation),
        "Run.split": Call(run.split, {}, {"dataset": OBJECT}),
        "Run.is_trained_on": Call(run.is_trained_on, {}, {"dataset": OBJECT}),
        "draw_scene": Call(bisplat.draw_scene, {"scene": scene, "path": "a.png"}),
        "write_scene": Call(bisplat.write_scene, {"scene": scene, "folder": "out"}),
        "facing": Call(bisplat.facing, {}, {"boresight": (*POINT, (0, 0, 0))}),
        "Gateway": Call(
            bisplat.Gateway,
            {"position": (0, 0, 1), "orientation": (0, 0, 0, 1)},
            {"position": ANYWHERE, "elements": ("x", 3, [[0, 0]], [["0", "0", "0"]])},
            {name: "checked with the scene" for name in ("rows", "columns", "spacing", "pattern", "polarization")},
        ),
        "Transmitter": Call(
            bisplat.Transmitter,
            {"region_min": (0, 0, 0), "region_max": (1, 1, 1)},
            {"region_min": ANYWHERE, "region_max": ANYWHERE},
            {name: "checked with the scene" for name in ("pattern", "polarization")},
        ),
        "RadioMaterial": Call(
            bisplat.RadioMaterial,
            material,
            {name: (*NUMBER, -1, None) for name in material if name != "name"}
            | {"frequency": (*NUMBER, 0, -1)}
            | {name: (*NUMBER, -1, 2, None) for name in ("scattering_coefficient", "xpd_coefficient")}
            | {"color": ("x", None, 3, (0, 0), (0, 0, 2), (0, 0, "x"), (0, 0, NAN))},
            {"name": "checked with the scene"},
        ),
        "p2040_materials": Call(
            bisplat.p2040_materials,
            {"names": ["concrete"], "frequency": 1e9},
            {"names": ("concrete", 3, ["x"], [3], np.ones((2, 3))), "frequency": (*NUMBER, 0, None)},
        ),
        "shapes.box": Call(bisplat.shapes.box, {"low": (0, 0, 0), "high": (1, 1, 1)}, {"low": [*POINT, (1, 0, 0)]}),
        "shapes.sheet": Call(
            bisplat.shapes.sheet,
            {"corner": (0, 0, 0), "u": (1, 0, 0), "v": (0, 1, 0)},
            {
                "u": [*POINT, (0, 0, 0)], "v": [*POINT, (0, 0, 0), (2, 0, 0)],
                "openings": (
                    "x", 3, [(0, 1)], [(0, 0.5, 0, "1")], [(0, 2, 0, 1)], [(0.5, 0.1, 0, 1)], [(0, NAN, 0, 1)],
                ),
            },
        ),
        "shapes.rotate": Call(bisplat.shapes.rotate, {"mesh": mesh, "degrees": 90}, {"degrees": NUMBER}),
        "shapes.bounding_box": Call(bisplat.shapes.bounding_box, {}, {"points": POINTS[:5] + POINTS[6:8]}),
        "shapes.union": Call(lambda part: bisplat.shapes.union(part), {}, {"part": OBJECT}),
    }  # fmt: skip


NOT_CALLED = {
    "InputError": "an error",
    "SpectrumModel": "a base class",
    "PredictsResponses": "a protocol",
    "Prediction": "what a method returns, checked where it is used",
    "Run": "made by train and load_run",
    "Dataset": "made by simulate and read_dataset",
    "Scene": "checked where it is used",
    "SceneObject": "checked with the scene",
    "shapes": "a module, whose functions are in the table",
}
"""Public names that are not in the table."""


@pytest.fixture(scope="module")
def table(tiny, tmp_path_factory) -> dict[str, Call]:
    run = bisplat.train(tiny, tmp_path_factory.mktemp("runs") / "mlp", model="mlp", steps=1)
    file = tmp_path_factory.mktemp("meshes") / "floor.ply"
    bisplat.shapes.sheet((0, 0, 0), (9, 0, 0), (0, 9, 0)).export(file)
    places = np.random.default_rng(0).uniform(0, 3, (12, 3))
    bisplat.write_dataset(
        file.with_name("powers"), places, powers=-50 - 10 * places[:, :1], gateways={"door": (0, 0, 1)}, frequency=2.4e9
    )
    banded = np.exp(1j * np.arange(20 * 4 * 8)).reshape(20, 4, 8)
    square = bisplat.PlanarArray(2, 2)
    bisplat.write_dataset(file.with_name("wide"), np.eye(20, 3), banded, square, 2.4e9, bandwidth=20e6)
    write_links(file.with_name("links"), np.exp(1j * np.arange(12 * 2 * 8)).reshape(12, 2, 8))
    write_links(file.with_name("placed_links"), np.exp(1j * np.arange(12 * 2 * 8)).reshape(12, 2, 8))
    write_positions(file.with_name("placed_links") / "tx_pos.csv", places)
    sight = bisplat.Propagation(max_depth=0, diffraction=False, rays=100)
    bisplat.simulate_rooms(file.with_name("rooms"), 1, spectra=12, propagation=sight)
    return calls(run, tiny, bisplat.load_scene("closet"), file)


def test_every_public_callable_and_each_of_its_parameters_is_in_the_table(table):
    public = {name for name in bisplat.__all__ if name not in NOT_CALLED}
    public |= {f"shapes.{name}" for name in ("bounding_box", "box", "sheet", "union", "rotate")}
    classes = ("AngularGrid", "Band", "Beamformer", "Measurement", "PlanarArray", "ElementArray", "Run", "Tracer")
    for name in classes:
        methods = inspect.getmembers(getattr(bisplat, name), inspect.isfunction)
        public |= {f"{name}.{method}" for method, function in methods if method[0] != "_" and takes_arguments(function)}
    public -= {"Tracer.multipath", "Tracer.middle_multipath"}  # of the exports
    assert public <= set(table), sorted(public - set(table))
    for name, call in table.items():
        if name != "shapes.union":
            missing = set(inspect.signature(call.function).parameters) - {*call.wrong, *call.exempt, "report"}
            assert not missing, f"{name}: {missing}"


def takes_arguments(method: Callable[..., Any]) -> bool:
    return len(inspect.signature(method).parameters) > 1


def test_wrong_arguments_are_refused_at_once(table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    failures = []
    for name, call in table.items():
        for parameter, values in call.wrong.items():
            for value in values:
                use = partial(call.function, **{**call.valid, parameter: value})
                found = failure(use) or ["wrote " + path.name for path in tmp_path.iterdir()]
                failures += [f"{name}({parameter}={value!r:.60}): {each}" for each in found]
                for path in tmp_path.iterdir():
                    shutil.rmtree(path) if path.is_dir() else path.unlink()
    assert not failures, "\n".join(failures)


def failure(use: Callable[[], Any]) -> list[str]:
    """What is wrong with a refusal, in one sentence; empty if nothing is."""
    began = time.perf_counter()
    try:
        use()
        found = "accepted"
    except bisplat.InputError as error:
        sentence, seconds = str(error), time.perf_counter() - began
        if sentence.isprintable() and len(sentence) < 600 and seconds < AT_ONCE:
            return []
        found = f"{seconds:.1f} s, {sentence!r}"
    except Exception as error:  # noqa: BLE001  anything else is what this test looks for
        found = f"{type(error).__name__}: {error}"[:200]
    return [found]


GIVEN = np.array([[0.75, 1.25, 1.0], [1.0, 1.5, 1.25]])


@pytest.mark.parametrize(
    "form",
    [
        np.ndarray.tolist, lambda points: points.astype(np.float16), lambda points: points[::-1].copy()[::-1],
        np.asfortranarray, lambda points: list(map(tuple, points)), lambda points: np.repeat(points, 2, axis=0)[::2],
    ],
    ids=["lists", "float16", "reversed", "columns first", "tuples", "strided"],
)  # fmt: skip
def test_positions_are_taken_in_every_form(form, table):
    given = form(GIVEN)
    for name in ("Run.predict", "Tracer.responses"):
        use = table[name].function
        found, expected = use(given), use(GIVEN)
        if name == "Run.predict":
            found, expected = found.spectra, expected.spectra
        assert np.array_equal(found, expected), name
