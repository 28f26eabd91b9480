"""A scene at another place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene, SceneObject


def shifted(scene: Scene, step: Float[np.ndarray, " 3"]) -> Scene:
    """Return a scene in which everything is moved by the same step: gateways, transmitter region and objects."""

    def gateway(old: Gateway) -> Gateway:
        return replace(old, position=tuple(np.asarray(old.position) + step))

    def item(old: SceneObject) -> SceneObject:
        return replace(old, mesh=old.mesh.copy().apply_translation(step))

    low, high = scene.transmitter.region + step
    return replace(
        scene,
        gateway=gateway(scene.gateway),
        transmitter=replace(scene.transmitter, region_min=tuple(low), region_max=tuple(high)),
        objects=tuple(item(each) for each in scene.objects),
        further_gateways={name: gateway(each) for name, each in scene.further_gateways.items()},
    )
