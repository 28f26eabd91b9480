"""Options that would do nothing in a call are refused. An option is given if its value is not its default."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from scenes.files.errors import ParameterError
from scenes.files.options import changed
from simulate.rays.core.propagation import Propagation

if TYPE_CHECKING:  # its import takes long, and the help of the command line does not need it
    from scenes.scene.description import Scene


def given_options(command: Callable[..., None], values: Mapping[str, Any]) -> list[str]:
    """The options of a command that were given, by the values that it was called with."""
    parameters = inspect.signature(command).parameters.values()
    return [each.name for each in parameters if values[each.name] != each.default]


def refuse_idle(options: Collection[str], idle: Iterable[str], where: str) -> None:
    """Refuse the first of the idle options that was given."""
    for name in idle:
        if name in options:
            raise ParameterError(name, f"expected none, since it does nothing {where}")


def refuse_idle_propagation(propagation: Propagation, scenes: Iterable[Scene]) -> None:
    """Refuse options of the ray tracer that do nothing beside others of them, or in these scenes."""
    options = changed(propagation)
    if propagation.max_depth == 0:
        refuse_idle(options, ["diffuse", "patches", "rays"], "with --max-depth 0, as the line of sight needs none")
    if not propagation.diffuse:
        refuse_idle(options, ["patches"], "without --diffuse")
    elif propagation.sionna:
        refuse_idle(options, ["patches"], "with --sionna")
    materials = [scene.materials[item.material] for scene in scenes for item in scene.objects]
    if not any(each.scattering_coefficient > 0 for each in materials):
        refuse_idle(options, ["diffuse"], "without an object whose material has a scattering_coefficient above 0")
