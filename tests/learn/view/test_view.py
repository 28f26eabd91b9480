"""What the viewer shows, without a browser: panels, hemisphere, and what belongs to a run, a dataset or a scene."""

import json
import shutil
import threading
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
import torch
from matplotlib import colormaps
from scipy.spatial.transform import Rotation

from learn.models.networks.aperture import BiSplatAperture
from learn.models.networks.bisplat import BiSplatWRF
from learn.view.chart import BACKGROUND, DECIBELS, LEFT, LINEAR, TOP, Panel, colour_of, draw, in_decibels
from learn.view.compared_spectra import in_phase_with, numbers, panels
from learn.view.hemisphere import DOT_DEG, dots, ellipses
from learn.view.subject import Spectrum, subject
from learn.view.tab import Tab
from learn.view.tracing import Tracing
from scenes.files.errors import InputError
from scenes.files.optional_packages import MissingExtraError
from simulate.rays import tracer
from simulate.rays.core.propagation import Propagation
from simulate.spectra.angular_grid import AngularGrid, direction
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import normalise

GRID = AngularGrid()


@pytest.fixture
def wave(plane_waves) -> Spectrum:
    """One plane wave from azimuth 200°, elevation 40°."""
    return seen(plane_waves((1, 200, 40)))


def seen(responses) -> Spectrum:
    """As ``Spectrum.of``, but for the eight bits, which make several pixels the highest."""
    field = Beamformer().steering @ responses
    return Spectrum(normalise(np.abs(field)), field)


# Panels


def test_pixel_of_a_direction_has_its_colour_in_both_views():
    peak = np.zeros((90, 360))
    peak[59:62, 88:93] = 1  # around elevation 60°, azimuth 90°
    yellow = (255 * np.array(colormaps["viridis"](1.0)[:3])).round()
    rectangular = draw([Panel("", peak, LINEAR)], "rectangular", GRID)
    np.testing.assert_array_equal(rectangular[TOP + 29, LEFT + 90], yellow)
    polar = draw([Panel("", peak, LINEAR)], "polar", GRID)  # up from the middle, a third of the way to the edge
    inside = polar[:, : LEFT + 270]  # without the colour bar
    rows, columns = np.nonzero((inside == yellow).all(axis=-1))
    assert abs(rows.mean() - (TOP + 135 - 45)) < 1 and abs(columns.mean() - (LEFT + 135)) < 1


def test_a_grid_of_half_a_turn_is_blank_in_the_other_half():
    """Azimuths 0° to 179.5°, and elevations from 45° on: only the upper half of the inner disc."""
    grid, everywhere = AngularGrid(45.0, 0.5, 0.5), np.ones((90, 360))
    polar = draw([Panel("", everywhere, LINEAR)], "polar", grid)[TOP : TOP + 270, LEFT : LEFT + 270]
    drawn = (polar != BACKGROUND).any(axis=-1)
    rows, columns = np.mgrid[:270, :270] + 0.5 - 135
    radius = np.hypot(rows, columns)
    assert drawn[(rows < -1) & (radius < 66)].all()
    assert not drawn[(rows > 2) | (radius > 70)].any()


def test_decibels_end_at_the_lowest():
    values = in_decibels(np.array([[1.0, 0.1, 0.0]]) * 0.5)
    np.testing.assert_allclose(values, [[0, -20, -30]])
    np.testing.assert_array_equal(colour_of(np.array(-30.0), DECIBELS), colour_of(np.array(-90.0), DECIBELS))


def test_difference_is_between_what_is_shown_on_one_scale(wave):
    other = Spectrum(0.5 * wave.values, wave.field)
    first, second, difference = panels("m", other, "recorded, spectrum 1", wave, GRID, in_phase=False, in_db=False)
    assert first.colours == second.colours
    np.testing.assert_allclose(difference.values, -0.5 * wave.values)
    over_their_maxima = panels("m", other, "x", wave, GRID, False, in_db=True)[2]
    assert over_their_maxima.values == pytest.approx(0)


def test_common_phase_is_no_difference(wave):
    turned = Spectrum(wave.values, wave.field * np.exp(2j))
    drawn = panels("m", turned, "x", wave, GRID, in_phase=True, in_db=False)
    assert np.abs(drawn[2].values).max() < 1e-6
    np.testing.assert_allclose(in_phase_with(turned.field, wave.field), wave.field, atol=1e-9)
    pictures = panels("m", Spectrum(wave.values), "x", wave, GRID, in_phase=True, in_db=False)
    assert len(pictures) == 2 and pictures[0].values is None and "its phase is not known" in pictures[0].title


def test_numbers_name_the_maxima_and_what_is_between(wave, plane_waves):
    moved = seen(plane_waves((1, 210, 40)))
    text = numbers(moved, "ray-traced", wave, Beamformer(), 12.0)
    assert "predicted: dominant direction azimuth 210°, elevation 40°" in text
    assert "ray-traced: dominant direction azimuth 200°, elevation 40°" in text
    assert "7.7° apart" in text and "12 ms" in text  # 10° of azimuth, cos 40° shorter
    assert "SSIM" not in numbers(None, "ray-traced", wave, Beamformer(), 0.0)


# Hemisphere


def test_dots_are_where_their_pixels_look():
    places, (rows, columns) = dots(2.0, AngularGrid(2.0))
    np.testing.assert_allclose(places, 2 * direction(np.radians(columns), np.radians(rows + 2)))
    assert np.linalg.norm(places, axis=1) == pytest.approx(2) and (places[:, 2] > 0).all()


@pytest.mark.parametrize("grid", [AngularGrid(), AngularGrid(2.0), AngularGrid(1.0, 89 / 90)])
def test_dots_leave_no_hole_through_which_the_room_shows(grid):
    places, _ = dots(1.0, grid)
    towards = np.random.default_rng(0).normal(size=(4000, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    towards[:, 2] = abs(towards[:, 2])
    towards = np.vstack([towards[towards[:, 2] > np.sin(np.radians(1))], [[0, 0, 1]]])
    cosine = (towards @ places.T).max(axis=1)
    assert np.degrees(np.arccos(cosine.clip(max=1))).max() < DOT_DEG


def test_primitives_on_the_sphere_are_as_wide_as_on_the_chart(small, region):
    """One standard deviation along an axis of the chart's Gaussian, against the covariance on the sphere."""
    torch.manual_seed(0)
    with torch.inference_mode():
        splats = BiSplatWRF(region, Beamformer(), 0.33, **small).splats(torch.tensor([[1.0, 0.0, 1.0]]))
    drawn = ellipses(splats, radius=1.0)
    scale, turn = splats.scale[0].double().numpy(), splats.rotation[0].double().numpy()
    for index in (0, 7, 39):
        phi, theta = splats.azimuth[index].item(), splats.elevation[index].item()
        for axis, towards in enumerate(((np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn)))):
            step = [0.001 * component[index] for component in towards]
            near, far = (direction(np.radians(phi + s * step[0]), np.radians(theta + s * step[1])) for s in (-1, 1))
            tangent = (far - near) / (2 * 0.001) * scale[index, axis]
            turned = Rotation.from_quat(drawn["batched_wxyzs"][index], scalar_first=True).inv().apply(tangent)
            on_disc = (
                turned / drawn["batched_scales"][index]
            )  # where the drawn disc has that point: on its rim, and flat
            np.testing.assert_allclose([np.linalg.norm(on_disc[:2]), on_disc[2]], [1, 0], atol=1e-3)
            np.testing.assert_allclose(
                drawn["batched_positions"][index], direction(np.radians(phi), np.radians(theta)), atol=1e-5
            )


# What belongs together


def test_dataset_alone_has_pictures_positions_and_copying(tiny):
    found = subject(str(tiny))
    assert found.run is None and found.scene is None and "no ray tracing" in found.missing[0]
    assert list(found.predictors) == ["inverse-distance", "nearest"]
    test = found.parts.test
    copied = found.predictors["nearest"](found.dataset.positions[found.parts.known[3]])
    np.testing.assert_allclose(copied, found.dataset.spectra[found.parts.known[3]])
    assert found.scores.shape == test.shape and (found.scores < 1).all() and (found.scores > 0.2).all()


def test_run_is_predicted_as_by_the_command(finished_run, small_models):
    found = subject(str(finished_run))
    assert next(iter(found.predictors)) == "bisplat-aperture"
    position = np.array([1.0, 0.3, 1.0])
    expected = found.run.predict(position[None]).spectra[0]
    np.testing.assert_array_equal(found.predictors["bisplat-aperture"](position), expected)
    np.testing.assert_allclose(normalise(np.abs(found.field(position))), expected, atol=1e-4)
    assert len(found.splats(position).azimuth) == 40


def test_field_of_a_model_without_responses_is_the_one_it_renders(tiny_config, changed, small_models, tmp_path):
    from learn.training.train import train_run

    train_run(changed(tiny_config, model="bisplat", steps=1), tmp_path / "run")
    found = subject(str(tmp_path / "run"))
    assert not isinstance(found.run.model, BiSplatAperture)
    position = np.array([1.0, 0.3, 1.0])
    np.testing.assert_allclose(
        np.abs(found.field(position)) ** 2, found.run.predict(position[None]).spectra[0], atol=1e-5
    )


def test_run_without_its_dataset_is_shown_with_a_note(finished_run, small_models, tmp_path):
    run = shutil.copytree(finished_run, tmp_path / "run")
    config = json.loads((run / "config.json").read_text())
    (run / "config.json").write_text(json.dumps({**config, "dataset": str(tmp_path / "gone")}))
    found = subject(str(run))
    assert found.dataset is None and "dataset of this run cannot be used" in found.missing[0]
    assert list(found.predictors) == ["bisplat-aperture"] and len(found.tested) == 0 == len(found.scores)


def test_scene_alone_has_a_region_and_nothing_to_predict():
    found = subject("office")
    assert found.predictors == {} and found.dataset is None and len(found.tested) == 0
    np.testing.assert_array_equal(found.region[0], found.scene.transmitter.region_min)


def test_neither_run_nor_dataset_nor_scene_is_refused(tmp_path):
    with pytest.raises(InputError, match='unknown scene "offic"'):
        subject("offic")
    with pytest.raises(InputError, match=r"tx_pos\.csv: expected"):
        subject(str(tmp_path))


# Tracing


class SlowTracer:
    """In the tracer's place: waits to be told to go on."""

    def __init__(self, *arguments):
        self.go, self.traced = threading.Event(), []
        SlowTracer.made = self

    def responses(self, positions):
        assert self.go.wait(10)
        self.traced.append(float(positions[0, 0]))
        return np.ones((1, 16), np.complex64)

    def paths(self, position):
        return []


def test_only_the_latest_request_of_each_tab_is_traced(monkeypatch):
    monkeypatch.setattr(tracer, "Tracer", SlowTracer)
    tracing = Tracing(None, Beamformer(), Propagation(), np.zeros((2, 3)))
    done, last, other = [], threading.Event(), threading.Event()
    tracing.request("tab", np.array([0.0, 0, 0]), done.append)
    while not hasattr(SlowTracer, "made"):
        pass
    for x in (1.0, 2.0, 3.0):
        tracing.request("tab", np.array([x, 0, 0]), lambda traced: (done.append(traced), last.set()))
    tracing.request("closed tab", np.array([5.0, 0, 0]), done.append)
    tracing.forget("closed tab")
    tracing.request("other tab", np.array([9.0, 0, 0]), lambda traced: other.set())
    SlowTracer.made.go.set()
    assert last.wait(10) and other.wait(10)
    assert set(SlowTracer.made.traced) <= {0.0, 3.0, 9.0} and done[-1].position[0] == 3.0


def test_position_that_cannot_be_traced_is_said_and_does_not_end_the_tracing(monkeypatch, caplog):
    def responses(positions):
        if positions[0, 0] > 1:
            raise ValueError("too far away")
        return np.ones((1, 16), np.complex64)

    made = SimpleNamespace(responses=responses, paths=lambda position: [])
    monkeypatch.setattr(tracer, "Tracer", lambda *arguments: made)
    tracing = Tracing(None, Beamformer(), Propagation(), np.zeros((2, 3)))
    states, traced = [], threading.Event()
    tracing.request("one tab", np.full(3, 9.0), lambda traced: None)
    tracing.request("another", np.zeros(3), lambda _: (states.append(tracing.state), traced.set()))
    assert traced.wait(10) and states == ["no ray tracing: too far away"]
    assert "ValueError: too far away" in caplog.text


@pytest.mark.parametrize(
    ("error", "logged"), [(InputError("libLLVM: found 14"), True), (MissingExtraError("rays", "ray tracing"), False)]
)
def test_tracer_that_cannot_be_made_is_said_and_a_fault_is_logged(monkeypatch, error, logged, caplog):
    monkeypatch.setattr(tracer, "Tracer", MagicMock(side_effect=error))
    tracing = Tracing(None, Beamformer(), Propagation(), np.zeros((2, 3)))
    for _ in range(200):
        if tracing.state.startswith("no ray tracing"):
            break
        threading.Event().wait(0.05)
    assert str(error) in tracing.state and ("Traceback" in caplog.text) == logged


def built(**subject) -> tuple[Tab, MagicMock]:
    """A tab whose panel is built in a page that notes what is asked of it."""
    tab, client = Tab.__new__(Tab), MagicMock()
    tab.client, tab.subject, tab.shield = client, SimpleNamespace(array_moves=False, **subject), lambda each: each
    tab._recorded = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]])
    tab._position, tab._asked, tab._changed, tab._tracing, tab._handle = np.zeros(3), 0, MagicMock(), None, MagicMock()
    tab._build()
    return tab, client.gui


def test_of_several_recordings_at_one_position_the_chosen_one_is_shown():
    tab, _ = built(missing=[])
    for index in (2, 1, 3, 2):
        tab._go_to(index)
        assert tab._recorded_at(tab._position) == index
    places = tab._recorded
    assert tab._recorded_at(places[3]) == 3 and tab._recorded_at(places[0]) == 0
    assert tab._recorded_at(np.array([0.5, 0, 0])) is None


def test_dataset_without_a_training_part_predicts_nothing(tiny, tmp_path):
    folder = shutil.copytree(tiny, tmp_path / "data")
    (folder / "train_index.txt").write_text("")
    found = subject(str(folder))
    assert found.predictors == {} and len(found.scores) == 0 and found.known_region is None


def test_names_in_a_panel_are_text():
    _, gui = built(missing=["no [link](x) <img src=x>"])
    assert gui.add_markdown.call_args_list[0].args == (r"**Note.** no \[link\]\(x\) \<img src\=x\>",)


def test_dataset_whose_scene_is_gone_is_shown_with_a_note(tiny, tmp_path):
    folder = shutil.copytree(tiny, tmp_path / "data")
    (folder / "metadata.json").write_text(json.dumps({"scene_file": "scene/scene.yaml"}))
    found = subject(str(folder))
    assert found.scene is None and "scene of this dataset cannot be read" in found.missing[0]
