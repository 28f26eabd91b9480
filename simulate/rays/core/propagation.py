"""The propagation mechanisms that the ray tracer follows, and how far it follows them."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.files.errors import require_whole

DEPTH_MOST, RAYS_MOST, PATCHES_MOST = 30, 10**8, 10**6
"""Largest numbers of interactions, rays and patches; more would exhaust the memory."""


@dataclass(frozen=True)
class Propagation:
    """Propagation mechanisms, and the number of rays that search for paths.

    Attributes:
        max_depth: largest number of interactions on a path. With more than three, spectra were farther from full wave
            (docs/physics.md).
        los: follow the line of sight.
        specular: follow specular reflection.
        refraction: follow transmission through objects.
        diffuse: follow diffuse reflection off materials that have a scattering coefficient.
        patches: patches that the surfaces which reflect diffusely are divided into, together.
        diffraction: follow diffraction at edges, once or (at conductors) twice on a path.
        slab_phase: count the way through a slab once. Otherwise it counts twice, as in Sionna RT and in version 0.1
            (simulate/rays/core/slab_phase.py).
        sionna: follow all of these as Sionna RT's own path solver does, its diffuse reflection and its diffraction
            included: much slower, and its diffraction is farther from full wave (docs/sionna-diffraction.md).
        rays: rays launched from each source; about 20000 suffice for Sionna's diffuse reflection and diffraction,
            where every ray may become a path.

    Raises:
        ParameterError: a depth or a number of rays or patches that is no whole number, a negative depth, no rays, no
            patches, or more than ``DEPTH_MOST``, ``RAYS_MOST`` or ``PATCHES_MOST``.

    >>> Propagation(sionna=True).sionna_diffraction
    True
    """

    max_depth: int = 3
    los: bool = True
    specular: bool = True
    refraction: bool = True
    diffuse: bool = False
    patches: int = 2000
    diffraction: bool = True
    slab_phase: bool = True
    sionna: bool = False
    rays: int = 1_000_000

    def __post_init__(self) -> None:
        require_whole(0, DEPTH_MOST, max_depth=self.max_depth)
        require_whole(1, RAYS_MOST, rays=self.rays)
        require_whole(1, PATCHES_MOST, patches=self.patches)

    @property
    def sionna_diffuse(self) -> bool:
        """Whether Sionna's diffuse reflection is followed."""
        return self.sionna and self.diffuse

    @property
    def sionna_diffraction(self) -> bool:
        """Whether Sionna's diffraction is followed."""
        return self.sionna and self.diffraction

    @property
    def counts_slabs_once(self) -> bool:
        """Whether the phases of slabs are ours."""
        return self.slab_phase and not self.sionna
