"""A scene at another frequency, with an array of the same size in metres."""

from __future__ import annotations

from dataclasses import replace

from scenes.scene.description import Scene


def with_same_array(scene: Scene, frequency: float) -> Scene:
    """The scene at another frequency. Its array keeps its size in metres, so its spacing in wavelengths changes.

    Example:
        >>> from scenes.places.closet import closet
        >>> with_same_array(closet(), 1830e6).gateway.spacing
        1.0
    """
    there, own = scene.at_frequency(frequency), scene.gateway
    if own.elements is not None:  # their positions are in metres
        return there
    return replace(there, gateway=replace(own, spacing=own.spacing * frequency / scene.frequency))
