"""Options of the ray tracer that would change nothing, since others of them, or the scene, leave nothing to follow."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from bisplat.commands.given_options import refuse_given
from simulate.rays.core.propagation import Propagation

if TYPE_CHECKING:  # its import takes long, and the help of the command line does not need it
    from scenes.scene.description import Scene


def refuse_idle_propagation(propagation: Propagation, scenes: Iterable[Scene]) -> None:
    """Refuse options of the ray tracer that the user gave and that have no effect.

    Args:
        propagation: the options of the call.
        scenes: the scenes to trace.

    Raises:
        InputError: the user gave one.
    """
    if propagation.max_depth == 0:
        idle = ["--specular", "--diffuse", "--patches", "--diffraction", "--rays"]
        idle += ["--refraction", "--slab-phase"] if propagation.sionna else []
        refuse_given(idle, "a --max-depth above 0, since the line of sight needs none")
    if not propagation.diffuse:
        refuse_given(["--patches"], "--diffuse with it, found no diffuse reflection")
    elif propagation.sionna:
        refuse_given(["--patches"], "none with --sionna, whose path solver has no patches")
    if propagation.sionna:
        refuse_given(["--slab-phase"], "none with --sionna, which counts the way through a slab twice")
    rough = {
        item.material
        for scene in scenes
        for item in scene.objects
        if scene.materials[item.material].scattering_coefficient > 0
    }
    if not rough:
        refuse_given(["--diffuse"], "an object whose material has a scattering_coefficient above 0, found none")
