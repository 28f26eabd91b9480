"""Places of a sheet or a few, what they are made of, and Sionna's own solver to compare with."""

from collections.abc import Callable

import numpy as np
import pytest

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.rays.core.propagation import Propagation

MATERIALS = {
    material.name: material
    for material in (
        RadioMaterial("concrete", 5.24, 0.043, 0.3),  # so lossy that its far side hardly matters
        RadioMaterial("brick", 3.91, 0.024, 0.1),
        RadioMaterial("lossless", 4.0, 0.0, 0.05),  # all of it interference between its two sides
        RadioMaterial("metal", 1.0, 1e7, 0.002),
    )
}


@pytest.fixture(scope="session")
def make_scene() -> Callable[..., Scene]:
    """Function: objects (name, mesh, material) -> scene; the gateway looks along -x, its y axis is up."""

    def make(*objects: tuple, gateway: Gateway | None = None, transmitter: Transmitter | None = None) -> Scene:
        return Scene(
            name="tiny",
            frequency=915e6,
            gateway=gateway or Gateway(position=(0.0, 0.0, 1.5), orientation=facing((-1, 0, 0))),
            transmitter=transmitter or Transmitter(region_min=(-5, -1, 0.5), region_max=(-2, 1, 2.5)),
            objects=tuple(SceneObject(*item) for item in objects),
            materials={item[2]: MATERIALS[item[2]] for item in objects},
        )

    return make


@pytest.fixture(scope="session")
def floor() -> tuple:
    """An object: a concrete floor at z = 0."""
    return "floor", sheet((-20, -20, 0), (40, 0, 0), (0, 40, 0)), "concrete"


@pytest.fixture(scope="session")
def far_sheet() -> tuple:
    """An object: a sheet so far away and so small that it plays no role. Mitsuba wants at least one."""
    return "far", sheet((5000, 5000, 5000), (1, 0, 0), (0, 1, 0)), "concrete"


@pytest.fixture(scope="session")
def room(make_scene, floor) -> Scene:
    """Floor, two walls that meet, and a screen that hides the gateway from a part of the region."""
    return make_scene(
        floor,
        ("side", sheet((-20, 2.5, 0), (40, 0, 0), (0, 0, 3)), "brick"),
        ("back", sheet((-6, -20, 0), (0, 40, 0), (0, 0, 3)), "lossless"),
        ("screen", sheet((-1.4, -2.2, 0.4), (0, 1.8, 0), (0, 0, 1.5)), "brick"),
    )


@pytest.fixture(scope="session")
def room_positions(room) -> np.ndarray:
    """Twelve places all over the region, in view of the gateway and behind the screen."""
    low, high = room.transmitter.region_min, room.transmitter.region_max
    return np.random.default_rng(5).uniform(low, high, (12, 3))


@pytest.fixture(scope="session")
def two_bounces() -> Propagation:
    """Depth 2 with few rays, and the phases of slabs that Sionna has, for comparison with it."""
    return Propagation(max_depth=2, diffraction=False, rays=100_000, slab_phase=False)


@pytest.fixture(scope="session")
def room_tracer(room, two_bounces):
    """The room's tracer, to be read from only."""
    from simulate.rays.tracer import Tracer

    return Tracer(room, two_bounces)


@pytest.fixture(scope="session")
def room_responses(room_tracer, room_positions) -> np.ndarray:
    """What the tracer says at ``room_positions``."""
    return room_tracer.responses(room_positions)


@pytest.fixture(scope="session")
def public_solver() -> Callable[..., np.ndarray]:
    """Function: the element responses that Sionna RT's public ``PathSolver`` gives at one transmitter position.

    For a gateway that looks along -x with its y axis up: Sionna's device, which looks along +x with z up, turned by
    half a turn about z; then gateway x is the device's y and gateway y the device's z. Paths with more reflections than
    ``depth`` are left out, and so are those that pass through more than two further objects.
    """
    from simulate.rays.core.sionna_scene import build_scene, mi, rt

    def solve(scene: Scene, position: np.ndarray, rays: int, depth: int, gateway_sends: bool) -> np.ndarray:
        sionna = build_scene(scene)
        gateway = scene.gateway
        assert np.allclose(gateway.orientation, facing((-1, 0, 0)))
        x = [(m % gateway.columns - (gateway.columns - 1) / 2) / 2 for m in range(gateway.rows * gateway.columns)]
        y = [(m // gateway.columns - (gateway.rows - 1) / 2) / 2 for m in range(gateway.rows * gateway.columns)]
        single = rt.PlanarArray(num_rows=1, num_cols=1, pattern="iso", polarization="V")
        planar = rt.AntennaArray(single.antenna_pattern, mi.Point3f(0, mi.Float(x), mi.Float(y)))
        sionna.tx_array, sionna.rx_array = (planar, single) if gateway_sends else (single, planar)
        at_gateway = {"position": mi.Point3f(*gateway.position), "orientation": mi.Point3f(np.pi, 0, 0)}
        at_tag = {"position": mi.Point3f(*map(float, position)), "orientation": mi.Point3f(0, 0, 0)}
        sender, receiver = (at_gateway, at_tag) if gateway_sends else (at_tag, at_gateway)
        sionna.add(rt.Transmitter("sender", **sender))
        sionna.add(rt.Receiver("receiver", **receiver))
        paths = rt.PathSolver(deterministic=True)(
            sionna,
            max_depth=depth + 2,
            samples_per_src=rays,
            max_num_paths_per_src=10_000,  # by default there is memory for a million
            synthetic_array=False,
            refraction=True,
            seed=11,
        )
        real, imaginary = (part.numpy().astype(float) for part in paths.a)
        delay = paths.tau.numpy().astype(float)
        values = (real + 1j * imaginary) * np.exp(-2j * np.pi * scene.frequency * delay)
        reflections = (paths.interactions.numpy() == int(rt.InteractionType.SPECULAR)).sum(axis=0)
        values = np.where(reflections <= depth, values, 0)
        return values.sum(axis=-1).ravel()  # [receiver, its antennas, sender, its antennas]

    return solve
