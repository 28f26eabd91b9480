"""Trace a scene: the complex response of every array element to every transmitter position.

By reciprocity the gateway's elements are the sources and the transmitters are the targets. The gateway never moves, so
one search for paths serves many transmitters. Every element is traced at its true position. Indoors, a half-metre array
at 915 MHz is in the near field, where a single point with plane-wave phases (``synthetic_array``) is inaccurate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain

import numpy as np
from jaxtyping import Complex, Float

from scenes.files.errors import ParameterError, check_array, require_instance, require_seed, shown
from scenes.scene.description import Scene, conducting_objects
from simulate.positions.positions import check_points
from simulate.rays.chain_solver import ChainSolver, Found
from simulate.rays.core.multipath import Multipath, TracedPath, strongest_first
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene, with_transmissions
from simulate.rays.core.sionna_scene import Antennas, gateway_antennas, transmitter_antennas
from simulate.rays.diffraction.edges import Edges
from simulate.rays.diffuse_reflection import Scattering
from simulate.rays.sionna_solver import ShootingSolver
from simulate.spectra.band import Band


class Tracer:
    """A ray tracer for one scene: element responses and paths for transmitters at any position.

    The constructor searches once for the chains of reflections and diffractions that carry power. The methods
    then solve these chains exactly for every element and transmitter by the image method (``method`` is
    "chains"). Diffuse reflection comes from patches of the rough surfaces, which are drawn once. With
    ``Propagation(sionna=True)``, Sionna RT [hoydis2023] instead shoots rays from every element for each batch of
    transmitters (``method`` is "shooting").

    Args:
        scene: the scene, with one gateway.
        propagation: the mechanisms to follow.
        region: lowest and highest corner of a box around all transmitters, metres, world frame, [2, 3]; by default the
            region of the scene's transmitter. Chains that reach only other places are not found.
        seed: seed of the rays and of the patches.
        report: function that gets a sentence after each round of the search.
        found: what ``found`` of a tracer with the same arguments returned; then nothing is searched.

    Attributes:
        scene: the scene.
        region: the box around all transmitters, metres, world frame, [2, 3].
        ray_scene: the scene in the form that the ray tracer uses, in coordinates of its own (``RayScene.origin``).
        elements: the gateway's elements, with their ``positions``, metres, world frame.
        method: "chains" or "shooting".

    Raises:
        InputError: libLLVM is missing or too old.
        ParameterError: ``propagation`` has so many rays that the paths of one transmitter exceed the memory; the region
            or the seed is not valid. The methods raise it for positions that are not rows of finite numbers.

    Example:
        A gateway above a concrete floor; the paths are the line of sight and one reflection:

        >>> import bisplat, numpy as np
        >>> floor = bisplat.SceneObject("floor", bisplat.shapes.sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete")
        >>> gateway = bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((-1, 0, 0)))
        >>> region = bisplat.Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2))
        >>> materials = bisplat.p2040_materials(["concrete"], 915e6)
        >>> yard = bisplat.Scene("yard", 915e6, gateway, region, (floor,), materials)
        >>> propagation = bisplat.Propagation(max_depth=1, diffraction=False, rays=20_000)
        >>> tracer = bisplat.Tracer(yard, propagation)
        >>> tracer.responses(np.array([[-3.0, 0.0, 1.0]])).shape
        (1, 16)
        >>> [len(path.vertices) for path in tracer.paths(np.array([-3.0, 0.0, 1.0]))]
        [2, 3]
    """

    def __init__(
        self,
        scene: Scene,
        propagation: Propagation,
        region: Float[np.ndarray, "2 3"] | None = None,
        seed: int = 1,
        report: Callable[[str], None] = lambda sentence: None,
        found: Found | None = None,
    ):
        require_instance(Scene, scene=scene)
        require_instance(Propagation, propagation=propagation)
        require_seed(seed=seed)
        self.scene = scene
        if region is not None:
            region = check_points(check_array("region", region, (2, 3), "two corners x, y, z"), "region")
        self.ray_scene = RayScene.of(scene, propagation)
        self.elements = gateway_antennas(scene)
        self._elements = gateway_antennas(self.ray_scene.description)  # in coordinates of the ray scene
        offsets = self._elements.positions - np.asarray(self.ray_scene.description.gateway.position)
        self._middle_index = np.argmin(np.linalg.norm(offsets, axis=1).round(6), keepdims=True)
        self._middle = self._elements.subset(self._middle_index)
        self._seed = seed
        self.method = "shooting" if propagation.sionna else "chains"
        self.region = scene.transmitter.region if region is None else region
        self._solver: ChainSolver | ShootingSolver
        if propagation.sionna:
            self._solver, self._found = ShootingSolver(self.ray_scene, len(self.elements), seed), Found(None, None)
        else:
            region = self.region - self.ray_scene.origin
            self._solver = ChainSolver(self.ray_scene, region, seed, report, found)
            self._found = self._solver.found
        scatters = propagation.diffuse and not propagation.sionna and propagation.max_depth > 0
        self._scattering = Scattering(self.ray_scene, seed) if scatters else None

    @property
    def found(self) -> Found:
        """The chains that were found, to be passed as ``found`` to another tracer of the same scene."""
        return self._found._replace(edges=None)  # in that scene, objects may have moved

    def at_frequency(self, scene: Scene) -> Tracer:
        """The tracer of the same scene at another frequency. It follows the same chains, so nothing is searched.

        Args:
            scene: the scene at that frequency. It may differ in its array, and in the properties of its materials, but
                the same objects must be conductors.

        Returns:
            The other tracer.

        Raises:
            ParameterError: other objects are conductors.
        """
        require_instance(Scene, scene=scene)
        own = self.ray_scene.description
        if (conducting_objects(scene) != conducting_objects(own)).any():
            raise ParameterError(
                "frequencies",
                f"expected frequencies at which the same objects are conductors, found that they differ between "
                f"{own.frequency / 1e6:g} and {scene.frequency / 1e6:g} MHz; simulate them one by one",
            )
        return Tracer(scene, self.ray_scene.propagation, self.region, self._seed, found=self._found)

    @property
    def edges(self) -> Edges | None:
        """The edges of the scene that diffract; None if diffraction is not followed."""
        return self._found.edges

    @property
    def chains(self) -> int:
        """Number of chains. Those without diffraction come first. If rays are shot, they count as one chain."""
        return self._solver.chains

    def responses(
        self, positions: Float[np.ndarray, "K 3"], factors: Complex[np.ndarray, " chains"] | None = None
    ) -> Complex[np.ndarray, "K elements"]:
        """Element responses to a transmitter at each position.

        The response of element m is y_m = Σ a e^{−j2πfτ}, summed over its paths of delay τ. The amplitude a contains
        the free-space factor λ/4π, so ``|y_m|²`` is the channel gain. The responses to one position do not depend on
        the others.

        Args:
            positions: transmitter positions, metres, world frame, [K, 3].
            factors: a factor for the paths of each chain, [chains]; by default 1. Diffuse reflection keeps the factor
                1.

        Returns:
            Complex responses, not normalised, complex64, [K, elements].
        """
        targets = self._targets(check_points(positions))
        if factors is not None:
            factors = check_array("factors", factors, (self.chains,), f"a factor for each of {self.chains} chains", "c")
        result = np.zeros((len(targets), len(self.elements)), np.complex128)
        for chains, paths in self._solver.paths(self._elements, targets):
            if factors is not None:
                paths = paths._replace(responses=paths.responses * factors[chains])
            paths.add_to(result)
        if self._scattering is not None:
            result += self._scattering.responses(self._elements, targets)
        return result.astype(np.complex64)

    def band_responses(
        self, positions: Float[np.ndarray, "K 3"], band: Band
    ) -> Complex[np.ndarray, "K elements subcarriers"]:
        """Element responses at every subcarrier of a band around the scene's frequency.

        The paths are found once, at the scene's frequency, and each is solved at a few frequencies of the band
        (``simulate.rays.chain_solver``). The permittivity and the conductivity of the materials are those at the
        scene's frequency.

        Args:
            positions: transmitter positions, metres, world frame, [K, 3].
            band: the subcarriers.

        Returns:
            Complex responses, not normalised, complex64, [K, elements, subcarriers].

        Raises:
            ParameterError: the band is wider than a fifth of the scene's frequency, or Sionna's path solver is used.
        """
        positions = check_points(positions)
        require_instance(Band, band=band)
        if isinstance(self._solver, ShootingSolver):
            raise ParameterError("band", "expected no band where Sionna's path solver is used (sionna)")
        frequencies = band.frequencies(self.ray_scene.description.frequency)
        targets = self._targets(positions)
        result = self._solver.band_responses(self._elements, targets, frequencies)
        if self._scattering is not None:
            result += self._scattering.band_responses(self._elements, targets, frequencies)
        return result.astype(np.complex64)

    def responses_with(
        self, others: Sequence[Scene], positions: Float[np.ndarray, "K 3"]
    ) -> Complex[np.ndarray, "others K elements"]:
        """Element responses in scenes of the same geometry but other materials.

        The paths are found only once, for all scenes. Diffuse reflection is left out.

        Args:
            others: scenes that differ from this one only in the properties of their materials and the thicknesses of
                their objects. The same objects must be conductors.
            positions: transmitter positions, metres, world frame, [K, 3].

        Returns:
            Complex responses, not normalised, complex64, [others, K, elements].
        """
        positions = check_points(positions)
        if not isinstance(others, Sequence) or not others:
            raise ParameterError("others", f"expected a list of scenes, found {shown(others)}")
        for each in others:
            require_instance(Scene, others=each)
        scenes = [RayScene.of(each, self.ray_scene.propagation) for each in others]
        result = np.zeros((len(scenes), len(positions), len(self.elements)), np.complex128)
        for index, paths in self._solver.paths_in(scenes, self._elements, self._targets(positions)):
            paths.add_to(result[index])
        return result.astype(np.complex64)

    def responses_by_chain(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K elements chains"]:
        """The contribution of each chain to ``responses``. Diffuse reflection belongs to no chain.

        Args:
            positions: transmitter positions, metres, world frame, [K, 3].

        Returns:
            Complex contributions, complex64, [K, elements, chains]. Without diffuse reflection their sum over the
            chains is ``responses``.
        """
        return self._by_chain(self._elements, check_points(positions))

    def middle_by_chain(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K chains"]:
        """``responses_by_chain`` of the array's middle element alone. A chain without a path contributes exactly 0.

        Args:
            positions: transmitter positions, metres, world frame, [K, 3].

        Returns:
            Complex contributions, complex64, [K, chains]. The middle element is that of ``middle``.
        """
        return self._by_chain(self._middle, check_points(positions))[:, 0]

    def _by_chain(
        self, elements: Antennas, positions: Float[np.ndarray, "K 3"]
    ) -> Complex[np.ndarray, "K elements chains"]:
        result = np.zeros((len(positions), len(elements), self.chains), np.complex64)
        for chains, paths in self._solver.paths(elements, self._targets(positions)):
            np.add.at(result, (paths.targets, paths.sources, chains), paths.responses)
        return result

    @property
    def middle(self) -> Antennas:
        """The middle element of the array, which is the first of those nearest the gateway's position."""
        return self.elements.subset(self._middle_index)

    def _targets(self, positions: Float[np.ndarray, "K 3"]) -> Antennas:
        return transmitter_antennas(self.ray_scene.description, positions - self.ray_scene.origin)

    def paths(self, position: Float[np.ndarray, " 3"]) -> list[TracedPath]:
        """The paths between one transmitter position and the array's middle element.

        Args:
            position: metres, world frame, [3].

        Returns:
            The paths, strongest first. Each has ``vertices``, the points from the element over the interactions to the
            transmitter (metres, world frame, [vertices, 3]), and ``response``, its complex contribution a e^{−j2πfτ}
            to the element's response. The middle element is that of ``middle``.
        """
        place = check_array("position", position, (3,), "one position x, y, z")
        return strongest_first(self.middle_multipath(check_points(place[None], "position")))

    def multipath(self, positions: Float[np.ndarray, "K 3"]) -> Iterator[Multipath]:
        """The single paths behind ``responses``, in batches. Diffuse reflection is left out.

        Args:
            positions: transmitter positions, metres, world frame, [K, 3].

        Yields:
            Batches of paths, each with the indices ``targets`` of the positions and ``sources`` of the elements, the
            complex ``responses``, and the ``vertices``, metres, world frame.
        """
        for batch in self._solver.multipath(self._elements, self._targets(positions)):
            yield self._placed(batch)

    def middle_multipath(self, positions: Float[np.ndarray, "K 3"]) -> Iterator[Multipath]:
        """The single paths of the array's middle element, in batches, with those of diffuse reflection.

        Args:
            positions: transmitter positions, metres, world frame, [K, 3].

        Yields:
            Batches as those of ``multipath``, with a vertex wherever a path passes through an object. All ``sources``
            are 0, the middle element.
        """
        if self.method == "shooting":  # which chains an element's rays find depends on the other elements'
            for batch in self.multipath(positions):
                chosen = batch.sources == self._middle_index
                batch = Multipath(*(each[chosen] for each in batch))
                yield batch._replace(sources=np.zeros_like(batch.sources))
            return
        targets = self._targets(positions)
        diffuse = () if self._scattering is None else self._scattering.multipath(self._middle, targets)
        for batch in chain(self._solver.multipath(self._middle, targets), diffuse):
            yield self._placed(with_transmissions(self.ray_scene, batch))

    def _placed(self, found: Multipath) -> Multipath:
        """Paths with their vertices in the user's coordinates."""
        return found._replace(vertices=found.vertices + self.ray_scene.origin)
