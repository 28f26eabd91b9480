"""Public functions and classes of ``bisplat``, called from Python with one or two arguments that have other values."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import bisplat

POSITIONS = np.array([[1.5, 1.0, 1.2], [1.7, 1.1, 1.0]])

VALUES: dict[str, Callable[[], Any]] = {
    **{repr(each)[:20]: (lambda each=each: each) for each in (None, True, 0, -1, 3, 1.5, 10**400, "", "x", "0")},
    **{f"{each!r}": (lambda each=each: each) for each in (float("nan"), float("inf"), 1e300, 1j)},
    "an empty list": list,
    "a mapping": dict,
    "a list of words": lambda: ["a", "b"],
    "a ragged list": lambda: [[1, 2, 3], [1]],
    "a path": lambda: Path("nowhere"),
    "a link to nothing": lambda: Path("/proc/self/fd/999"),
    "a whole number of NumPy": lambda: np.int64(3),
    "a float of NumPy": lambda: np.float32(0.5),
    "an array of none": lambda: np.zeros((0, 3)),
    "an array of one dimension": lambda: np.zeros(3),
    "positions": lambda: POSITIONS,
    "positions as a list": lambda: POSITIONS.tolist(),
    "positions backwards": lambda: POSITIONS[::-1],
    "positions in half precision": lambda: POSITIONS.astype(np.float16),
    "positions in columns": lambda: np.asfortranarray(POSITIONS),
    "complex positions": lambda: POSITIONS + 1j,
    "positions with NaN": lambda: POSITIONS * np.nan,
    "masked positions": lambda: np.ma.masked_greater(POSITIONS, 1.5),
    "positions as objects": lambda: POSITIONS.astype(object),
    "positions as text": lambda: POSITIONS.astype(str),
    "positions far away": lambda: POSITIONS * 1e9,
    "read-only positions": lambda: np.frombuffer(POSITIONS.tobytes()).reshape(2, 3),
}
"""What takes the place of an argument, by name; made anew for each call."""

PICTURES = np.zeros((2, 90, 360), np.uint8)

CALLS: dict[str, Callable[[], dict[str, Any]]] = {
    "PlanarArray": lambda: {"rows": 4, "columns": 4, "spacing": 0.5},
    "ElementArray": lambda: {"positions_m": [[0, 0, 0], [0.1, 0, 0]], "frequency": 915e6},
    "AngularGrid": lambda: {"elevation_first_deg": 0.0, "elevation_step_deg": 1.0, "azimuth_step_deg": 1.0},
    "Propagation": lambda: {"max_depth": 1, "los": True, "rays": 100, "diffraction": False},
    "Measurement": lambda: {"snr_db": 10.0, "gain_error_db": 1.0, "phase_error_deg": 1.0},
    "Tolerances": lambda: {"position": 0.1, "rotation": 1.0, "objects": 0.1, "materials": 0.1},
    "Gateway": lambda: {"position": (0, 0, 1), "orientation": (0, 0, 0, 1), "rows": 4, "columns": 4, "spacing": 0.5},
    "Transmitter": lambda: {"region_min": (1, 1, 1), "region_max": (2, 2, 2), "pattern": "iso"},
    "facing": lambda: {"boresight": (1, 0, 0)},
    "p2040_material": lambda: {"name": "concrete", "frequency": 915e6, "thickness": 0.1},
    "p2040_materials": lambda: {"names": ["concrete"], "frequency": 915e6},
    "load_scene": lambda: {"name_or_path": "closet"},
    "read_dataset": lambda: {"folder": "data"},
    "load_run": lambda: {"folder": "network"},
    "check": lambda: {"folder": "data"},
    "evaluate": lambda: {"run": "nowhere", "dataset": "data", "index": None},
    "train": lambda: {
        **{"dataset": "data", "output": "out", "model": "mlp-responses", "split": "files", "seed": 0},
        **{"options": None, "steps": 2, "batch_size": 2, "learning_rate": 1e-3, "init": None},
    },
    "simulate": lambda: {
        **{"scene": "closet", "output": "out", "n": 3, "engine": "fullwave", "placement": "uniform"},
        **{"positions": None, "seed": 0, "field": "field", "measurement": bisplat.Measurement(), "power_db": False},
    },
    "compare": lambda: {
        **{"dataset": "data", "models": ["nearest"], "split": "files", "budget": 1.0, "seeds": 1},
        **{"test_spectra": 1, "output": "out"},
    },
    "compare_powers": lambda: {
        **{"dataset": "powers", "methods": ["mean"], "split": "random", "train_size": 3, "seed": 0, "guard": 0.0},
        **{"seeds": 1, "budget": 1.0},
    },
    "compare_channels": lambda: {
        **{"dataset": "csi", "methods": ["ramp", "delays"], "split": "random", "train_size": 3, "seed": 0},
        **{"guard": 0.0, "seeds": 1, "budget": 1.0},
    },
    "compare_band": lambda: {
        **{"dataset": "data", "methods": ["nearest"], "split": "random", "train_size": 3, "seed": 0}
    },
    "crossvalidate": lambda: {"run": "network", "scene": "closet", "positions": 2, "seed": 1, "field": "field"},
    "plan": lambda: {"run_or_scene": "kriged", "n": 2, "seed": 0},
    "locate_powers": lambda: {"dataset": "powers", "heard": [[-60.0]], "known": None, "level": 0.0, "seed": 0},
    "locate_channels": lambda: {"dataset": "csi", "heard": [[[1j]]], "known": None, "seed": 0},
    "locate": lambda: {"runs": [], "pictures": []},
    "calibrate_powers": lambda: {**{"scene": "closet", "dataset": "nowhere", "n": 3, "split": "files", "seed": 0}},
    "calibrate": lambda: {"scene": "closet", "dataset": "nowhere", "n": 3, "split": "files", "seed": 0},
    "retrieve_responses": lambda: {"spectra": PICTURES / 255, "beamformer": bisplat.Beamformer(), "seed": 0},
    "import_scene": lambda: {
        **{"path": "meshes/wall.obj", "materials": [("*", "wood")], "default_material": None, "unit": "m", "up": None},
        **{"frequency": 915e6, "gateway": _gateway(), "transmitter": _transmitter()},
    },
    "write_scene": lambda: {"scene": bisplat.load_scene("closet"), "folder": "out"},
}
"""Arguments with which each of them works, or is refused at once."""


def _gateway() -> bisplat.Gateway:
    return bisplat.Gateway((0.5, 0.5, 1), bisplat.facing((1, 0, 0)))


def _transmitter() -> bisplat.Transmitter:
    return bisplat.Transmitter((1, 0.2, 0.5), (2, 0.8, 0.9))


def call(name: str, changes: dict[str, str]) -> int:
    """Call a function or class, and tell what became of it as a command does."""
    arguments = CALLS[name]() | {argument: VALUES[value]() for argument, value in changes.items()}
    try:
        getattr(bisplat, name)(**arguments)
    except bisplat.InputError as error:
        print(f"bisplat: {error}", file=sys.stderr)
        return 1
    return 0
