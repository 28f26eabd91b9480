"""The propagation mechanisms that the ray tracer follows, and how far it follows them."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.errors import ParameterError


@dataclass(frozen=True)
class Propagation:
    """Propagation mechanisms, and the number of rays that search for paths.

    Attributes:
        max_depth: largest number of interactions on a path.
        los: follow the line of sight.
        specular: follow specular reflection.
        refraction: follow transmission through objects.
        diffuse: follow diffuse reflection off materials that have a scattering coefficient.
        diffraction: follow diffraction at the edges of conductors, once or twice on a path.
        sionna_diffraction: follow Sionna RT's own diffraction instead, as version 0.2 did; much slower, and farther
            from full wave (docs/sionna-diffraction.md).
        rays: rays launched from each source; about 20000 suffice with diffuse reflection or Sionna's diffraction,
            where every ray may become a path.

    Raises:
        ParameterError: a depth or a number of rays that is no whole number, a negative depth, no rays, or two kinds
            of diffraction.

    >>> Propagation(max_depth=2).chains_suffice
    True
    >>> Propagation(diffuse=True, rays=20_000).chains_suffice
    False
    """

    max_depth: int = 5
    los: bool = True
    specular: bool = True
    refraction: bool = True
    diffuse: bool = False
    diffraction: bool = False
    sionna_diffraction: bool = False
    rays: int = 1_000_000

    def __post_init__(self) -> None:
        for name, least in (("max_depth", 0), ("rays", 1)):
            value = getattr(self, name)
            if not (isinstance(value, int) and value >= least):
                raise ParameterError(name, f"expected a whole number of at least {least}, found {value}")
        if self.diffraction and self.sionna_diffraction:
            raise ParameterError("sionna_diffraction", "expected one kind of diffraction, found both")

    @property
    def chains_suffice(self) -> bool:
        """Whether every path is a chain of interactions with planes and edges, which are solved exactly."""
        return not (self.diffuse or self.sionna_diffraction)
