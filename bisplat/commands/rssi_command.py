"""``bisplat rssi``."""

from __future__ import annotations

from pathlib import Path

from tyro.conf import OmitArgPrefixes, Positional

from bisplat.commands.idle_options import refuse_idle, refuse_idle_propagation
from bisplat.commands.scene_changes import SceneChanges, changed_scene
from bisplat.commands.simulate_command import Output
from scenes.files.atomic import require_writable
from scenes.files.errors import printable
from scenes.files.options import changed, checked, unchecked
from simulate.positions.places import Places
from simulate.rays.core.propagation import Propagation
from simulate.rssi.power_receiver import PowerReceiver


def rssi(
    scene: Positional[str],
    output: Output,
    gateways: Path,
    frequency: str | None = None,
    content: OmitArgPrefixes[unchecked(Places)] = unchecked(Places)(),  # type: ignore[valid-type]
    receiver: OmitArgPrefixes[unchecked(PowerReceiver)] = unchecked(PowerReceiver)(),  # type: ignore[valid-type]
    propagation: OmitArgPrefixes[unchecked(Propagation)] = unchecked(Propagation)(),  # type: ignore[valid-type]
) -> None:
    """Simulate the powers that gateways receive (RSSI).

    Each gateway has one element. The folder has the format of NeRF²'s BLE data. If the command is interrupted, the
    same command continues.

    Args:
        scene: built-in name (such as lab) or scene YAML. Its own gateways are left out.
        output: the folder: a new one, or one that the same command began.
        gateways: YAML file of the gateways: NAME: [x, y, z], or NAME: {position: [x, y, z], boresight: [x, y, z],
            pattern: dipole}; metres, world frame.
        frequency: carrier frequency instead of the scene's: hertz, or such as "2.4 GHz". Materials of ITU-R P.2040
            follow.
        content: where the transmitter is.
        receiver: what a gateway reports.
        propagation: what the ray tracer follows.
    """
    from scenes.storage.scene_yaml import load_scene
    from simulate.engines.rays_engine import Rays
    from simulate.rssi.rssi_simulation import make_rssi

    wanted, heard = checked(Places, content), checked(PowerReceiver, receiver)
    followed = checked(Propagation, propagation)
    if wanted.positions is not None:
        refuse_idle(changed(content), ["n", "placement"], f"beside --positions {wanted.positions}")
    require_writable(output / "metadata.json")
    place = changed_scene(load_scene(scene), SceneChanges(frequency=frequency))
    refuse_idle_propagation(followed, [place])
    made = make_rssi(place, output, gateways, wanted, heard, Rays(followed))
    print(printable(f"{len(made)} positions, {len(made.gateway_names)} gateways: {output}"))
