"""Diffuse reflection at patches of rough surfaces: one path for every source, patch and target.

This is the effective-roughness model [degliesposti2007] with Lambert's pattern, as in Sionna RT. A wave of field
strength E meets a patch of area A at the angle of incidence θ. It is scattered in all directions on the side that it
came from. At the angle θ' and the distance r the scattered wave has the field strength

    E S Γ √(A cos θ) √(cos θ' / π) / r,

where Γ² is the share of the power that a smooth surface would reflect. The polarisation, in the spherical unit vectors
of the world frame, is turned by arcsin √K_x.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Complex, Float, Int
from scipy.spatial.distance import cdist

from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.shapes import union
from simulate.rays.core.electric_field import Field, across, component, pass_through, pattern
from simulate.rays.core.multipath import Interaction, Multipath
from simulate.rays.core.propagation import MOST_PASSES
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import dr, mi, rt_utils
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.spectra.band import enough_frequencies, interpolated

FREQUENCIES_MORE = 10
"""Number of frequencies beyond those that the delays need. They make the error of the interpolation negligible."""

LANES = 400_000
"""Ways between a target and a patch that are followed at a time. This bounds the memory."""


class Scattering:
    """Waves that are reflected diffusely once, at patches that are drawn once, and otherwise go straight."""

    def __init__(self, ray_scene: RayScene, seed: int):
        patches = patches_of(ray_scene, ray_scene.propagation.patches, seed)
        self._ray_scene, self._scene = ray_scene, PatchScene(ray_scene, patches)
        self._objects = ray_scene.object_of_face[patches.faces]

    def responses(self, sources: Antennas, targets: Antennas) -> Complex[np.ndarray, "targets sources"]:
        """The sum of all paths from each source to each target."""
        return self._responses(self._scene, sources, targets)

    def band_responses(
        self, sources: Antennas, targets: Antennas, frequencies: Float[np.ndarray, " subcarriers"]
    ) -> Complex[np.ndarray, "targets sources subcarriers"]:
        """The sum of all paths at each subcarrier, interpolated between as many frequencies as its delays need."""
        points = self._scene.patches.points
        longest = sum(cdist(each.positions, points).max(initial=0) for each in (sources, targets))
        at = enough_frequencies(frequencies, longest / SPEED_OF_LIGHT, FREQUENCIES_MORE)
        scenes = [PatchScene(self._ray_scene, self._scene.patches, frequency) for frequency in at]
        found = np.stack([self._responses(each, sources, targets) for each in scenes], axis=-1)
        return interpolated(at, found, frequencies, delay=longest / SPEED_OF_LIGHT / 2)

    def _responses(
        self, scene: PatchScene, sources: Antennas, targets: Antennas
    ) -> Complex[np.ndarray, "targets sources"]:
        result = np.zeros((len(targets), len(sources)), np.complex128)
        for start, _, sent, taken in self._batches(scene, sources, targets):
            for number, each in enumerate(taken, start):
                result[number] += (sent * each).sum(axis=(1, 2))
        return result * scene.wavelength / (4 * np.pi)

    def multipath(self, sources: Antennas, targets: Antennas) -> Iterator[Multipath]:
        """The single paths whose sum ``responses`` returns, in batches."""
        for start, patches, sent, taken in self._batches(self._scene, sources, targets):
            for number, each in enumerate(taken, start):
                responses = (sent * each).sum(axis=2) * self._scene.wavelength / (4 * np.pi)
                source, which = np.nonzero(responses)
                ends = sources.positions[source], targets.positions[np.full(len(source), number)]
                yield Multipath(
                    targets=np.full(len(source), number),
                    sources=source,
                    responses=responses[source, which],
                    vertices=np.stack([ends[0], self._scene.patches.points[patches[which]], ends[1]], axis=1),
                    objects=self._objects[patches[which], None],
                    kinds=np.full((len(source), 1), int(Interaction.SCATTERING)),
                )

    def _batches(
        self, scene: PatchScene, sources: Antennas, targets: Antennas
    ) -> Iterator[
        tuple[int, Int[np.ndarray, " k"], Complex[np.ndarray, "sources k 2"], Complex[np.ndarray, "batch k 2"]]
    ]:
        """The results of ``_pairs`` for batches of targets, each with the index of the first target."""
        if not len(scene.patches):
            return
        scattered = scene.scattered(sources)
        batch = max(1, LANES // len(scene.patches))
        for start in range(0, len(targets), batch):
            received = scene.received(targets.subset(np.arange(start, min(start + batch, len(targets)))))
            for found in self._pairs(scattered, received):
                yield start, *found

    def _pairs(
        self, scattered: PatchFields, received: PatchFields
    ) -> Iterator[tuple[Int[np.ndarray, " k"], Complex[np.ndarray, "sources k 2"], Complex[np.ndarray, "targets k 2"]]]:
        """Patches, the waves that they scatter, and the share that targets receive."""
        for side in (1, -1):
            first, second = scattered.side == side, received.side == side
            patches = np.nonzero(first.any(axis=0))[0]
            if len(patches):
                yield (
                    patches,
                    np.where(first[:, patches, None], scattered.components[:, patches], 0),
                    np.where(second[:, patches, None], received.components[:, patches], 0),
                )


@dataclass(frozen=True)
class Patches:
    """Pieces of rough surfaces, all of one area."""

    points: Float[np.ndarray, "patches 3"]  # middle of each patch, metres, world frame
    faces: Int[np.ndarray, " patches"]  # number of each patch's triangle, counted through the scene's objects
    phases: Float[np.ndarray, " patches"]  # phase by which each patch delays the waves that it scatters, radians
    area: float  # area of each patch, m²

    def __len__(self) -> int:
        return len(self.points)


def patches_of(ray_scene: RayScene, count: int, seed: int) -> Patches:
    """Draw patches at random, uniformly by area, on the objects whose material has a scattering coefficient.

    The roughness of a surface is unknown, so the phase of each patch is drawn at random from 0 to 2π.
    """
    scene = ray_scene.description
    rough = np.array([scene.materials[item.material].scattering_coefficient > 0 for item in scene.objects])
    chosen = np.nonzero(rough[ray_scene.object_of_face])[0]
    if not len(chosen):
        return Patches(np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0), 0.0)
    mesh = union(*(item.mesh for item in scene.objects))
    mesh.update_faces(chosen)
    points, face = trimesh.sample.sample_surface(mesh, count, seed=seed)
    phases = np.random.default_rng([seed, 1]).uniform(0, 2 * np.pi, count)
    return Patches(np.asarray(points), chosen[face], phases, float(mesh.area) / count)


def _power(amplitude: mi.Complex2f) -> mi.Float:
    return amplitude.real**2 + amplitude.imag**2


@dataclass(frozen=True)
class PatchFields:
    """The fields that patches scatter from sources, or that targets receive from patches."""

    # components along θ̂ and φ̂, with the amplitude and phase of the way: of the wave that a patch scatters from each
    # source, or of a unit wave from a patch that each target receives; 0 if the way is blocked
    components: Complex[np.ndarray, "antennas patches 2"]
    # 1 if the antenna is on the side to which the patch's normal points, otherwise −1
    side: Int[np.ndarray, "antennas patches"]


class PatchScene:
    """A scene with the patches of its rough surfaces."""

    def __init__(self, ray_scene: RayScene, patches: Patches, frequency: float | None = None):
        scene = ray_scene.description
        self.patches = patches
        self._surfaces = Surfaces(ray_scene, frequency)
        self.wavelength = self._surfaces.wavelength
        turned = np.array([scene.materials[item.material].xpd_coefficient for item in scene.objects])
        self._turn = np.arcsin(np.sqrt(turned[ray_scene.object_of_face[patches.faces]]))

    def scattered(self, sources: Antennas) -> PatchFields:
        """The waves that the patches scatter when each source transmits, with the phases of the patches."""
        field, way, face, cosine = self._at_patches(sources, pattern)
        te, tm, _, _ = self._surfaces.coefficients(face, way)
        axis = across(way, self._surfaces.normal(face))
        in_te, in_tm = _power(component(field, axis)), _power(component(field, dr.cross(axis, way)))
        reflected = (_power(te) * in_te + _power(tm) * in_tm) / dr.maximum(in_te + in_tm, 1e-30)
        weight = self._surfaces.scattering(face) * dr.sqrt(reflected * self.patches.area * dr.abs(cosine))
        found = self._fields(sources, field, way, weight, cosine)
        along, across_it = np.cos(self._turn), np.sin(self._turn)
        theta, phi = found.components[..., 0], found.components[..., 1]
        turned = np.stack([along * theta - across_it * phi, across_it * theta + along * phi], axis=-1)
        return PatchFields(turned * np.exp(-1j * self.patches.phases)[:, None], found.side)

    def received(self, targets: Antennas) -> PatchFields:
        """The field that each target receives from a unit wave that a patch scatters."""

        def receiving(antennas: Antennas, towards: mi.Vector3f) -> Field:
            real, imaginary = pattern(antennas, towards)
            return real, -imaginary

        # By reciprocity the wave may be followed from the target to the patch.
        field, way, _, cosine = self._at_patches(targets, receiving)
        return self._fields(targets, field, -way, dr.sqrt(dr.abs(cosine) / np.pi), cosine)

    def _at_patches(self, antennas, send):
        """The antennas' fields at the patches, directions, triangles and cos θ."""
        count = len(self.patches)
        patch = dr.tile(dr.arange(mi.UInt, count), len(antennas))
        points = np.ascontiguousarray(self.patches.points.T, dtype=np.float32)
        start = dr.gather(mi.Point3f, antennas.points, dr.repeat(dr.arange(mi.UInt, len(antennas)), count))
        step = dr.gather(mi.Point3f, mi.Point3f(points), patch) - start
        length = dr.norm(step)
        way = mi.Vector3f(step / length)
        most = mi.UInt(MOST_PASSES if self._surfaces.refraction else 0)
        field, _, blocked = pass_through(self._surfaces, start, way, length, send(antennas, way), most, mi.Bool(False))
        face = dr.gather(mi.UInt, mi.UInt(self.patches.faces.astype(np.uint32)), patch)
        field = tuple(dr.select(blocked, 0, part) for part in field)
        return field, way, face, -dr.dot(way, self._surfaces.normal(face))

    def _fields(self, antennas, field, direction, weight, cosine) -> PatchFields:
        """Components along the spherical unit vectors of a direction, with the amplitude and phase of the way."""
        theta, phi = rt_utils.theta_phi_from_unit_vec(direction)
        parts = [weight * component(field, axis) for axis in (rt_utils.theta_hat(theta, phi), rt_utils.phi_hat(phi))]
        dr.eval(parts, cosine)
        shape = (len(antennas), len(self.patches))
        components = np.stack([(part.real.numpy() + 1j * part.imag.numpy()).reshape(shape) for part in parts], axis=-1)
        distance = np.linalg.norm(self.patches.points - antennas.positions[:, None], axis=-1)
        # A small surface in front of a disc-shaped patch of area A receives power as cos θ' / π (r² + A/π).
        spreading = 1 / np.sqrt(distance**2 + self.patches.area / np.pi)
        phase = -2j * np.pi * (distance / self.wavelength % 1)
        side = np.where(cosine.numpy() > 0, 1, -1).reshape(shape)
        return PatchFields(components * (spreading * np.exp(phase))[..., None], side)
