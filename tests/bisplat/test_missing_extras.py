"""Without any extra, everything about measured data works; what needs an extra says in a sentence how to install it."""

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

import bisplat
from scenes.files import optional_packages as extras
from scenes.places.built_in import lab
from scenes.storage.scene_writing import write_scene
from simulate.dataset.metadata import write_metadata
from simulate.dataset.spectra_folder import write_gateway
from simulate.dataset.written_dataset import write_dataset
from simulate.engines.rays_engine import Rays
from simulate.generation.request import Request
from simulate.positions.positions import write_positions
from tests.bisplat import without_extras

FIELD = str(Path(__file__).parents[1] / "data" / "closet")

ENVIRONMENT = os.environ | {
    "PYTHONPATH": str(Path(__file__).parents[2]),
    "OMP_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
}

WORK = (
    "--help",
    "check data",
    "dataset data -o converted",
    "dataset converted --retrieve",
    "train data -o run --model bisplat-aperture --steps 1 --batch-size 2",
    "predict run --positions data/tx_pos.csv -o out.npz",
    "compare data -o table --models nearest",
    "compare heard --split random --models helmholtz",
    "export data --hdf5 data.h5",
    "scene lab",
    f"simulate closet -o field --engine fullwave --field {FIELD} -n 10",
)
"""Commands that need no extra, in an order in which they find what they need."""

LONGER_WORK = (
    "train data -o default",
    "evaluate default",
    "export default -o default.pt2",
    "plan default -o next.csv -n 3",
    "locate default data -o where.csv",
    "train data -o mlp --model mlp --steps 1",
    "train data -o bisplat --model bisplat --steps 1 --batch-size 1",
    "scene sheet.obj -o sheet --default-material wood --gateway 0 0 1 --boresight 1 0 0 "
    "--region-min 0.2 0.2 1.2 --region-max 0.8 0.8 1.8",
)

REFUSED = {
    "scene lab -o new0.png --accuracy": "rays",
    "simulate lab -o new1": "rays",
    "simulate traced -o new2": "rays",
    "crossvalidate run --scene lab": "rays",
    "calibrate lab data -o new4": "rays",
    "plan lab -o new5.csv": "rays",
    "export traced --deepmimo new6": "rays",
    "train data -o new7 --model twin --scene lab": "rays",
    "compare heard --split random --models twin --scene lab": "rays",
    "demo -o new8": "rays",
    "scene sionna:etoile -o new9 --gateway 0 -150 30 --boresight 0 1 0 --region-min 0 0 1 --region-max 1 1 2": "rays",
    "view run": "viewer",
    "simulate closet -o new10 --engine fullwave -n 10 --ray localhost:6379": "ray",
    "simulate closet -o new11 --engine fullwave -n 10 --gpu": "fullwave",
    "export run -o new12.onnx": "onnx",
}
"""Commands that need an extra, and which."""


@pytest.fixture(scope="module")
def place(tmp_path_factory, write_folder) -> Path:
    """A folder with data, which looks measured at the lab's gateway, and traced, what is known of a traced dataset."""
    folder = tmp_path_factory.mktemp("place")
    scene = lab()
    write_folder(folder / "data")
    write_gateway(folder / "data" / "gateway_info.yml", "lab", scene.gateway.position, scene.gateway.orientation)
    heard = np.random.default_rng(0).uniform(1, 3, (20, 3))
    write_dataset(
        folder / "heard",
        heard,
        powers=-50 - 10 * heard[:, :1],
        gateways={"door": (1.0, 0.6, 2.2)},
        frequency=scene.frequency,
    )
    request = Request(scene, np.array([[2.5, 3.0, 1.2]]), "given", Rays(), 0)
    (folder / "traced").mkdir()
    write_scene(scene, folder / "traced" / "scene")
    write_positions(folder / "traced" / "tx_pos.csv", request.positions)
    write_metadata(folder / "traced" / "metadata.json", request.metadata())
    return folder


def outcomes_of(commands: Iterable[str], place: Path) -> dict[str, list]:
    """What became of each command in a folder: its exit status, and what it said on stderr."""
    program = [sys.executable, without_extras.__file__, json.dumps([each.split() for each in commands])]
    done = subprocess.run(program, capture_output=True, text=True, env=ENVIRONMENT, cwd=place)
    assert done.returncode == 0, done.stderr
    return dict(zip(commands, json.loads(done.stdout), strict=True))


@pytest.fixture(scope="module")
def outcomes(place) -> dict[str, list]:
    return outcomes_of([*WORK, *REFUSED], place)


@pytest.mark.parametrize("command", WORK)
def test_commands_for_measured_data_need_no_extra(outcomes, command):
    status, said = outcomes[command]
    assert status == 0, said


@pytest.mark.slow
def test_so_do_those_that_take_longer(place):
    (place / "sheet.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    for command, (status, said) in outcomes_of(LONGER_WORK, place).items():
        assert status == 0, f"{command}: {said}"
    assert (place / "default" / "evaluation" / "metrics.json").is_file()


@pytest.mark.slow
def test_help_on_the_package_leaves_out_only_what_traces_rays(place):
    code = (
        "from tests.bisplat.without_extras import hide_extras; hide_extras()\n"
        "import bisplat, pydoc; print(pydoc.render_doc(bisplat)); from bisplat import *\n"
        "print(bisplat._homes().keys() - globals().keys())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=ENVIRONMENT, cwd=place)
    assert done.returncode == 0, done.stderr
    assert "simulate(" in done.stdout
    assert ast.literal_eval(done.stdout.splitlines()[-1]) == {"Tracer", "calibrate"}


@pytest.mark.parametrize("command", REFUSED)
def test_a_command_that_needs_an_extra_says_so(outcomes, command, place):
    status, said = outcomes[command]
    assert status == 1 and said.startswith("bisplat: ") and said.count("\n") == 1
    assert said.endswith(f", which is not installed: pip install 'bisplat-wrf[{REFUSED[command]}]'\n")
    output = re.search(r"new\S*", command)
    assert output is None or not (place / output[0]).exists()


def test_every_extra_has_a_command():
    assert set(REFUSED.values()) >= set(extras.EXTRAS)


def test_python_gets_the_same_sentence(monkeypatch, tmp_path):
    monkeypatch.setattr(extras, "find_spec", lambda module: None)
    with pytest.raises(bisplat.InputError) as caught:
        bisplat.simulate("lab", tmp_path / "lab", n=10)
    assert "bisplat-wrf[rays]" in str(caught.value) and isinstance(caught.value, ImportError)
    assert not (tmp_path / "lab").exists()
