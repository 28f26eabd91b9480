"""What correlation with full wave the rays expect of themselves."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.files.progress import progress_bar
from scenes.scene.description import SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.shapes import sheet
from simulate.engines.engine import Setting
from simulate.engines.rays_engine import Rays
from simulate.parallel.machines import Machines
from simulate.rays import expected_correlation as module
from simulate.rays.core.propagation import Propagation
from simulate.rays.expected_correlation import PowerShares, Weights, expected_correlation, power_shares, weights
from simulate.rays.tracer import Tracer
from tests.small_scene import small_scene

FEW = Propagation(rays=20_000)


def with_panel(material: str):
    """A panel before the transmitters, which hides some of them."""
    scene = small_scene(SceneObject("panel", sheet((1.0, -0.2, 0.6), (0, 0.7, 0), (0, 0, 0.8)), material))
    return replace(scene, materials=p2040_materials(["concrete", "metal", "wood"], scene.frequency))


@pytest.mark.parametrize("material", ["metal", "wood"])
def test_shares_are_those_of_the_mechanisms(material):
    scene = with_panel(material)
    positions = np.random.default_rng(0).uniform(*scene.transmitter.region, (40, 3))
    ways = {"all": FEW, "geometric": replace(FEW, diffraction=False), "direct": replace(FEW, max_depth=0)}
    found = {name: Tracer(scene, used).middle_by_chain(positions).sum(axis=1) for name, used in ways.items()}
    shares = power_shares(Tracer(scene, FEW), positions)

    def share(field):
        return (np.abs(field) ** 2).sum() / (np.abs(found["all"]) ** 2).sum()

    assert shares.reflected == pytest.approx(share(found["geometric"] - found["direct"]), rel=1e-4)
    diffracted = share(found["all"] - found["geometric"])
    expected = (0, diffracted) if material == "metal" else (diffracted, 0)
    assert diffracted > 0.01 and (shares.at_sheets, shares.at_conductors) == pytest.approx(expected, rel=1e-4)


def test_more_power_on_disturbed_paths_means_less_correlation():
    given = Weights(0.01, (0.1, 0.2, 0.4), (0.5, 1.0, 2.0))
    low, middle, high = given.expected(PowerShares(0.3, 0.1, 0.05))  # 1 − c² = 0.01 + 0.03 + 0.02 + 0.02
    assert (low, middle, high) == pytest.approx(np.sqrt([1 - 0.16, 1 - 0.08, 1 - 0.04]))
    assert given.expected(PowerShares(9, 9, 9)).low == 0
    least, *steps = (weights().expected(PowerShares(*row)).middle for row in (np.zeros(3), *0.2 * np.eye(3)))
    assert least > 0.99 and max(steps) < least and steps[0] == max(steps)  # reflections are the nearest to the truth


def test_only_default_mechanisms_are_judged():
    scene = small_scene()
    region = scene.transmitter.region
    assert expected_correlation(Tracer(scene, FEW), scene, region).middle > 0.97
    for other in ({"diffraction": False}, {"max_depth": 2}, {"refraction": False}):
        assert expected_correlation(Tracer(scene, replace(FEW, **other)), scene, region) is None


@pytest.mark.parametrize(("constant", "said"), [(0.19, True), (0.01, False)])
def test_simulation_recommends_full_wave_where_little_is_expected(monkeypatch, capsys, tmp_path, constant, said):
    monkeypatch.setattr(module, "weights", lambda: Weights(constant, (0.0, 0.0, 0.0), (0.5, 1.0, 1.5)))
    scene = small_scene()
    with progress_bar() as progress:
        Rays(FEW).source(Setting(scene, scene.transmitter.region, 0), tmp_path, Machines(), progress)
    assert ("expected to correlate at 0.90 (0.85 to 0.95)" in " ".join(capsys.readouterr().err.split())) == said
