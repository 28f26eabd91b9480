"""The propagation mechanisms that the ray tracer follows, and how far it follows them."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.files.errors import require_whole
from scenes.files.options import check_kinds

DEPTH_MOST, RAYS_MOST, PATCHES_MOST = 30, 10**8, 10**6
"""Largest numbers of interactions, rays and patches. More would exhaust the memory."""

MOST_PASSES = 12  # Most objects that a path passes through. Behind so many, next to nothing is left.


@dataclass(frozen=True)
class Propagation:
    """The mechanisms of propagation that the ray tracer follows, and the number of rays that search for paths.

    Reflection and transmission use the slab coefficients of ITU-R P.2040 [itu2023]. Diffraction at edges of conductors
    uses the uniform theory [kouyoumjian1974]. Diffuse reflection uses the effective-roughness model
    [degliesposti2007].

    Attributes:
        max_depth: largest number of reflections and diffractions on a path. Passing through objects does not count,
            except with sionna. More than three made spectra less accurate.
        los: follow the line of sight.
        specular: follow specular reflection.
        refraction: follow transmission through objects.
        diffuse: follow diffuse reflection from materials with a scattering coefficient.
        patches: total number of patches on the surfaces that reflect diffusely.
        diffraction: follow diffraction at edges: once on a path, or twice at conductors.
        slab_phase: count the way through a slab once. Sionna RT counts it twice.
        sionna: use Sionna RT's own path solver. It is much slower, and its diffraction is less accurate.
        rays: number of rays of the search for paths, over all elements. With sionna, of each element or transmitter;
            with diffuse or diffraction, about 20000 suffice there.

    Raises:
        ParameterError: ``max_depth`` is outside 0 to 30, ``rays`` is outside 1 to 100 million, ``patches`` is outside 1
            to 1 million, one of them is no whole number, or a switch is neither true nor false.

    Example:
        Line of sight and single reflections only:

        >>> import bisplat
        >>> single = bisplat.Propagation(max_depth=1, refraction=False, diffraction=False)
        >>> single.max_depth, single.specular, single.diffraction
        (1, True, False)
        >>> bisplat.Propagation(max_depth=-1)
        Traceback (most recent call last):
        scenes.files.errors.ParameterError: max_depth: expected a whole number of at least 0, found -1
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
        check_kinds(self)
        require_whole(0, DEPTH_MOST, max_depth=self.max_depth)
        require_whole(1, RAYS_MOST, rays=self.rays)
        require_whole(1, PATCHES_MOST, patches=self.patches)

    @property
    def sionna_diffuse(self) -> bool:
        """Whether the tracer uses Sionna's diffuse reflection; both ``sionna`` and ``diffuse`` are on."""
        return self.sionna and self.diffuse

    @property
    def sionna_diffraction(self) -> bool:
        """Whether the tracer uses Sionna's diffraction; both ``sionna`` and ``diffraction`` are on."""
        return self.sionna and self.diffraction

    @property
    def counts_slabs_once(self) -> bool:
        """Whether the phase of a way through a slab counts once; ``slab_phase`` is on and ``sionna`` is off."""
        return self.slab_phase and not self.sionna
