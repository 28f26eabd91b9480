"""An exported DeepMIMO folder holds the traced paths: their sum is the traced response, their geometry the scene's."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scenes.files.errors import InputError
from scenes.scene.description import SPEED_OF_LIGHT, Scene, SceneObject
from scenes.scene.shapes import sheet
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.rays_engine import Rays
from simulate.exchange import deepmimo_export as module
from simulate.exchange.deepmimo_export import export_deepmimo
from simulate.generation.generate import generate
from simulate.generation.request import Request
from simulate.rays import diffuse_reflection
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.small_scene import small_scene

SCREEN = 1.5  # Metres: x of a sheet that hides one of the positions from the gateway

POSITIONS = np.array([[2.0, -0.5, 1.0], [2.5, 0.4, 1.2], [3.0, 0.1, 1.6]])


def simulated(scene: Scene, folder: Path, propagation: Propagation) -> Path:
    generate(Request(scene, POSITIONS, "given", Rays(propagation), seed=4), folder)
    return folder


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    """A dataset of the floor alone."""
    folder = tmp_path_factory.mktemp("deepmimo") / "plain"
    return simulated(small_scene(), folder, Propagation(max_depth=1, diffraction=False, rays=10_000))


@pytest.fixture(scope="module")
def rich(tmp_path_factory) -> Path:
    """A dataset with every interaction: a rough floor, and a screen to pass through."""
    screen = SceneObject("screen", sheet((SCREEN, -0.9, 0.2), (0, 0.7, 0), (0, 0, 2.5)), "wood")
    scene = small_scene(screen)
    concrete = replace(scene.materials["concrete"], scattering_coefficient=0.3)
    wood = replace(concrete, name="wood", relative_permittivity=2.0, thickness=0.03, scattering_coefficient=0.0)
    scene = replace(scene, materials=scene.materials | {"concrete": concrete, "wood": wood})
    folder = tmp_path_factory.mktemp("deepmimo") / "rich"
    return simulated(scene, folder, Propagation(max_depth=2, diffuse=True, patches=40, rays=10_000))


def matrices(folder: Path) -> dict[str, np.ndarray]:
    """The matrices of the only transmitter."""
    files = folder.glob("*_t000_tx000_r001.npz")
    return {name: np.load(file)[name] for file in files for name in [file.name.removesuffix("_t000_tx000_r001.npz")]}


@pytest.fixture(scope="module")
def exported(rich, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("deepmimo") / "rich_scenario"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "AT_ONCE", 2)
        patch.setattr(diffuse_reflection, "LANES", 1)
        export_deepmimo(rich, folder)
    return folder


@pytest.fixture(scope="module")
def expected(rich) -> np.ndarray:
    """Responses of the element that the paths are of."""
    responses = read_dataset(rich).responses
    assert responses is not None
    return responses[:, 5]


def direction(azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    """Unit vector of angles as DeepMIMO has them, degrees."""
    phi, theta = np.radians(azimuth), np.radians(elevation)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def test_line_of_sight_and_floor_reflection_are_those_of_geometry(plain, tmp_path):
    export_deepmimo(plain, tmp_path / "plain")
    found = matrices(tmp_path / "plain")
    element = Tracer(small_scene(), Propagation(max_depth=0)).middle.positions[0]
    assert found["tx_pos"] == pytest.approx(element[None], abs=1e-6)
    assert found["rx_pos"] == pytest.approx(POSITIONS, abs=1e-6)
    assert found["inter"].tolist() == [[0, 1]] * 3
    image = element * [1, 1, -1]
    hit = image + (POSITIONS - image) * (element[2] / (element[2] + POSITIONS[:, 2]))[:, None]
    assert np.isnan(found["inter_pos"][:, 0]).all()
    assert found["inter_pos"][:, 1, 0] == pytest.approx(hit, abs=1e-4)
    for path, leaves_to, comes_from in ((0, POSITIONS, element), (1, hit, hit)):
        length = np.linalg.norm(POSITIONS - (element, image)[path], axis=1)
        assert SPEED_OF_LIGHT * found["delay"][:, path] == pytest.approx(length, rel=1e-5)
        for angle, way in (("aod", leaves_to - element), ("aoa", comes_from - POSITIONS)):
            expected = way / np.linalg.norm(way, axis=1, keepdims=True)
            assert direction(found[f"{angle}_az"], found[f"{angle}_el"])[:, path] == pytest.approx(expected, abs=1e-4)
    wavelength, length = small_scene().wavelength, np.linalg.norm(POSITIONS - element, axis=1)
    assert found["power"][:, 0] == pytest.approx(20 * np.log10(wavelength / (4 * np.pi * length)), abs=0.3)  # isotropic
    phase = np.exp(1j * np.radians(found["phase"][:, 0]))
    assert np.abs(phase - np.exp(-2j * np.pi * length / wavelength)).max() < 1e-3


def test_paths_add_up_to_the_traced_response(exported, expected):
    found = matrices(exported)
    gains = np.sqrt(10 ** (found["power"] / 10)) * np.exp(1j * np.radians(found["phase"]))
    assert np.abs(np.nansum(gains, axis=1) / expected - 1).max() < 1e-5


def test_every_interaction_has_its_code_and_its_place(exported):
    found = matrices(exported)
    digits = set()
    for receiver, path in np.argwhere(found["inter"] > 0):
        code, points = f"{found['inter'][receiver, path]:.0f}", found["inter_pos"][receiver, path]
        assert np.isfinite(points).all(axis=1).sum() == len(code)
        course = np.vstack([found["tx_pos"], points[: len(code)], found["rx_pos"][receiver]])
        length = np.linalg.norm(np.diff(course, axis=0), axis=1).sum()
        assert SPEED_OF_LIGHT * found["delay"][receiver, path] == pytest.approx(length, rel=1e-5)
        digits |= set(code)
        for digit, (x, y, z) in zip(code, points, strict=False):
            on_floor, on_screen = abs(z) < 1e-3, abs(x - SCREEN) < 1e-3
            on_edge = on_screen and min(abs(y + 0.9), abs(y + 0.2), abs(z - 0.2), abs(z - 2.7)) < 1e-3
            where = {"1": on_floor or on_screen, "2": on_edge, "3": on_floor, "4": on_screen}
            assert where[digit], (code, digit, x, y, z)
    assert digits == {"1", "2", "3", "4"}
    assert {14, 41} & set(found["inter"].ravel())


def test_line_of_sight_comes_first_and_then_the_strongest(exported):
    found = matrices(exported)
    assert found["inter"][:, 0].tolist() == [4, 0, 0]  # the first position is behind the screen
    assert found["power"].shape[1] > 25
    for power, codes in zip(found["power"], found["inter"], strict=True):
        rest = power[codes > 0]
        assert (np.diff(rest) <= 0).all() and np.isfinite(power[: len(rest)]).all()


def test_position_without_paths_and_a_place_without_any(plain, tmp_path):
    """Nothing but reflections, and the floor ends before the first position's."""
    floor = SceneObject("floor", sheet((1.3, -9, 0), (18, 0, 0), (0, 18, 0)), "concrete")
    scene = replace(small_scene(), objects=(floor,))
    reflections = Propagation(max_depth=1, los=False, diffraction=False, rays=10_000)
    export_deepmimo(simulated(scene, tmp_path / "some", reflections), tmp_path / "some_paths")
    reached = np.isfinite(matrices(tmp_path / "some_paths")["power"][:, 0])
    assert 0 < reached.sum() < 3
    params = json.loads((tmp_path / "some_paths" / "params.json").read_text())
    assert params["txrx_sets"]["txrx_set_1"]["num_active_points"] == reached.sum()

    nothing = replace(reflections, max_depth=0)
    export_deepmimo(simulated(scene, tmp_path / "none", nothing), tmp_path / "no_paths")
    found = matrices(tmp_path / "no_paths")
    assert found["power"].shape == (3, 1) and np.isnan(found["power"]).all()


def edited(source: Path, folder: Path, **changes: object) -> Path:
    """A copy of a dataset's folder with other metadata; None: without the key."""
    shutil.copytree(source, folder)
    metadata = json.loads((folder / "metadata.json").read_text()) | changes
    metadata = {key: value for key, value in metadata.items() if value is not None}
    (folder / "metadata.json").write_text(json.dumps(metadata))
    return folder


def test_what_has_no_paths_is_refused_in_one_sentence(plain, tmp_path):
    output = tmp_path / "output" / "paths"
    measured = edited(plain, tmp_path / "measured", scene_file=None)
    fullwave = {"cell": 0.01, "solver": "ours", "window_ns": 50.0, "antennas": "short dipoles"}
    depth = {**json.loads((plain / "metadata.json").read_text())["propagation"], "max_depth": 16}
    for source, sentence in (
        (measured, "measured: expected a simulated dataset"),
        (tmp_path / "nowhere", "nowhere: expected a simulated dataset"),
        (edited(plain, tmp_path / "deep", propagation=depth), "max_depth of at most 15, .* found 16"),
        (edited(plain, tmp_path / "other", positions_sha256="x"), "positions that the dataset was made with"),
        (edited(plain, tmp_path / "waves", engine="fullwave", fullwave=fullwave), "of the engine fullwave"),
    ):
        with pytest.raises(InputError, match=sentence):
            export_deepmimo(source, output)
        assert not list((tmp_path / "output").iterdir())
    with pytest.raises(InputError, match="expected a lower-case name"):  # DeepMIMO cannot load it otherwise
        export_deepmimo(plain, tmp_path / "Yard")


def test_deepmimo_reads_it(exported, expected, capsys):
    """The Makefile installs the package without its dependencies: it asks for an older NumPy, but runs with ours."""
    deepmimo = pytest.importorskip("deepmimo")
    deepmimo.config("scenarios_folder", str(exported.parent))
    few, found = deepmimo.load(exported.name), deepmimo.load(exported.name, max_paths=10_000)
    assert few.power.shape[1] == 25 < found.power.shape[1]
    assert found.num_paths.min() > 25 and np.asarray(found.los).tolist() == [0, 1, 1]
    gains = np.sqrt(np.asarray(found.power_linear)) * np.exp(1j * np.radians(np.asarray(found.phase)))
    assert np.abs(np.nansum(gains, axis=1) / expected - 1).max() < 1e-5
    assert found.compute_pathloss() == pytest.approx(-20 * np.log10(np.abs(expected)), abs=1e-3)
    names = np.asarray(found.inter_str)
    assert names[:, 0].tolist() == ["T", "", ""] and {"R", "S", "D", "T"} <= set(names.ravel())

    carrier = deepmimo.ChannelParameters()
    carrier.bs_antenna.shape, carrier.ue_antenna.shape = np.array([1, 1]), np.array([1, 1])
    carrier.num_paths = found.max_paths
    carrier.ofdm.subcarriers, carrier.ofdm.selected_subcarriers = 1024, np.array([0])
    channel = np.asarray(found.compute_channels(carrier)).reshape(3)
    assert np.abs(channel * np.sqrt(1024) / expected - 1).max() < 1e-4

    assert [item.name for item in found.scene.objects] == ["floor", "screen"]
    assert [item.label for item in found.scene.objects] == ["terrain", "objects"]
    box = np.array([[SCREEN, -0.9, 0.2], [SCREEN, -0.2, 2.7]])
    assert found.scene.objects[1].bounding_box.bounds == pytest.approx(box)
    assert sorted(found.materials.name) == ["concrete", "wood"]
    assert found.rt_params["frequency"] == 915e6 and found.inter_obj[0, 0, 0] == 1  # it passes through the screen
