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
        max_depth: largest number of interactions on a path. More than three made spectra less accurate.
        los: follow the line of sight.
        specular: follow specular reflection.
        refraction: follow transmission through objects.
        diffuse: follow diffuse reflection from materials with a scattering coefficient.
        patches: total number of patches on the surfaces that reflect diffusely.
        diffraction: follow diffraction at edges: once on a path, or twice at conductors.
        slab_phase: count the way through a slab once. Sionna RT and version 0.1 count it twice.
        sionna: use Sionna RT's own path solver. It is much slower, and its diffraction is less accurate.
        rays: number of rays from each source. With sionna and diffuse or diffraction, about 20000 suffice.

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
