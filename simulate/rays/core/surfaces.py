"""The materials of a scene's surfaces, on the ray tracer's device."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.scene.description import conducting_objects
from scenes.scene.materials import relative_permittivity
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import dr, mi, rt_utils


class Surfaces:
    """The materials of a scene's triangles, on the ray tracer's device."""

    def __init__(self, ray_scene: RayScene, frequency: float | None = None):
        scene = ray_scene.description
        if frequency is not None:
            scene = replace(scene, frequency=float(frequency))
        materials = [scene.materials[item.material] for item in scene.objects]
        permittivity = np.array([relative_permittivity(material, scene.frequency) for material in materials])
        self.wavelength = scene.wavelength
        # A constant would be part of Dr.Jit's kernels, so every frequency would compile them again.
        self.wavenumber = 2 * dr.pi / dr.opaque(mi.Float, scene.wavelength)
        self.scene = ray_scene.sionna.mi_scene
        self.refraction = ray_scene.propagation.refraction
        self._permittivity = mi.Float(permittivity.real), mi.Float(permittivity.imag)
        self._thickness = mi.Float([scene.thickness(item) for item in scene.objects])
        self._scattering = mi.Float([material.scattering_coefficient for material in materials])
        self._conducts = mi.Bool(conducting_objects(scene))
        self._normals = [mi.Float(axis) for axis in ray_scene.normals.T]
        # Otherwise the phase of the way through a slab counts twice, as in Sionna RT.
        self._counts_once = float(ray_scene.propagation.counts_slabs_once)
        fronts = ray_scene.slabs.fronts * self._counts_once
        self._fronts = [mi.Float(side) for side in fronts.T]
        self._object = mi.UInt(ray_scene.object_of_face)
        self._first_face = mi.UInt(ray_scene.planes.first_face)

    def face(self, hit: mi.PreliminaryIntersection3f, active: mi.Bool) -> mi.UInt:
        """Number of the triangle that a ray hit."""
        shape = dr.reinterpret_array(mi.UInt, hit.shape)
        return dr.gather(mi.UInt, self._first_face, shape, active) + hit.prim_index

    def normal(self, face: mi.UInt, active: mi.Bool | bool = True) -> mi.Vector3f:
        """Unit normal of a triangle."""
        return mi.Vector3f(*(dr.gather(mi.Float, axis, face, active) for axis in self._normals))

    def conducts(self, face: mi.UInt, active: mi.Bool | bool = True) -> mi.Bool:
        """Whether a triangle belongs to a conductor."""
        return dr.gather(mi.Bool, self._conducts, dr.gather(mi.UInt, self._object, face, active), active)

    def scattering(self, face: mi.UInt) -> mi.Float:
        """Scattering coefficient S of a triangle: the share of the reflected amplitude that is scattered diffusely."""
        return dr.gather(mi.Float, self._scattering, dr.gather(mi.UInt, self._object, face))

    def middle(self, face: mi.UInt) -> mi.Float:
        """How far the middle of a triangle's slab is from the triangle, in the direction of its normal, metres."""
        front, back = (dr.gather(mi.Float, side, face) for side in self._fronts)
        return (front - back) / 2

    def coefficients(
        self, face: mi.UInt, way: mi.Vector3f, active: mi.Bool | bool = True
    ) -> tuple[mi.Complex2f, mi.Complex2f, mi.Complex2f, mi.Complex2f]:
        """Coefficients of a smooth slab (reflection TE, TM, transmission TE, TM), with the shortened way's phase."""
        along = dr.dot(way, self.normal(face, active))
        r_te, r_tm, t_te, t_tm = self._slab(face, dr.abs(along), active)
        fronts = [dr.gather(mi.Float, side, face, active) for side in self._fronts]
        reflected = self._turned(dr.abs(along), 2 * dr.select(along < 0, *fronts))
        passed = self._turned(dr.abs(along), fronts[0] + fronts[1])
        return reflected * r_te, reflected * r_tm, passed * t_te, passed * t_tm

    def centred_coefficients(
        self, face: mi.UInt, cosine: mi.Float
    ) -> tuple[mi.Complex2f, mi.Complex2f, mi.Complex2f, mi.Complex2f]:
        """The same coefficients for a slab whose middle is at the triangle, with the same rule for its phase."""
        thickness = dr.gather(mi.Float, self._thickness, dr.gather(mi.UInt, self._object, face))
        turned = self._turned(cosine, self._counts_once * thickness)
        r_te, r_tm, t_te, t_tm = self._slab(face, cosine)
        return turned * r_te, turned * r_tm, turned * t_te, turned * t_tm

    def _slab(self, face: mi.UInt, cosine: mi.Float, active: mi.Bool | bool = True):
        """Coefficients of ITU-R P.2040 [itu2023], whose phase is 0 at the faces of the slab."""
        item = dr.gather(mi.UInt, self._object, face, active)
        permittivity = mi.Complex2f(*(dr.gather(mi.Float, part, item, active) for part in self._permittivity))
        thickness = dr.gather(mi.Float, self._thickness, item, active)
        wavelength = 2 * dr.pi / self.wavenumber
        return rt_utils.itu_coefficients_single_layer_slab(cosine, permittivity, thickness, wavelength)

    def _turned(self, cosine: mi.Float, shortened: mi.Float) -> mi.Complex2f:
        """Phase factor of a way that is shorter by some metres along the normal."""
        return dr.exp(mi.Complex2f(0, self.wavenumber * cosine * shortened))
