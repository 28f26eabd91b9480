"""The waves between antennas and the patches of rough surfaces.

This is the effective-roughness model [degliesposti2007] with Lambert's pattern, as in Sionna RT. A wave of field
strength E meets a patch of area A at the angle of incidence θ. It is scattered in all directions on the side that it
came from. At the angle θ' and the distance r the scattered wave has the field strength

    E S Γ √(A cos θ) √(cos θ' / π) / r,

where Γ² is the share of the power that a smooth surface would reflect. The polarisation, in the spherical unit vectors
of the world frame, is turned by arcsin √K_x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Int

from simulate.rays.core.electric_field import Field, across, component, pass_through, pattern
from simulate.rays.core.propagation import MOST_PASSES
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import dr, mi, rt_utils
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.scattering.patches import Patches


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
