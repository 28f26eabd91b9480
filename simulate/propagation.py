"""What the ray tracer follows, and how far."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Propagation:
    """Propagation mechanisms and the effort spent on finding paths.

    Attributes:
        max_depth: largest number of interactions on a path.
        los: line of sight.
        specular: specular reflection.
        refraction: transmission through objects.
        diffuse: diffuse reflection (off objects whose material has a scattering coefficient).
        diffraction: first-order diffraction at edges.
        rays: rays launched from each source. With diffuse reflection every ray is a path to every transmitter, and
            20 000 are plenty; the chains of specular paths deserve a million, being found once for all.
        seed: seed of the ray launching.
    """

    max_depth: int = 5
    los: bool = True
    specular: bool = True
    refraction: bool = True
    diffuse: bool = False
    diffraction: bool = False
    rays: int = 1_000_000
    seed: int = 1

    @property
    def chains_suffice(self) -> bool:
        """Whether every path is a chain of reflections and refractions, which ``simulate.chains`` solves exactly."""
        return not (self.diffuse or self.diffraction)
