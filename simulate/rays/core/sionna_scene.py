"""A scene description as objects of Sionna RT [hoydis2023]: meshes with radio materials, and the antennas at both ends.

Frames: Sionna's devices look along their local +x, and their vertical polarisation is along local +z. The gateway looks
along its +z, and its vertical polarisation is along its +y. The cyclic permutation (x, y, z)_gateway = (y, z, x)_Sionna
maps one frame to the other.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from scenes.scene.description import Scene
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import GATEWAY_FROM_TRANSMITTER
from simulate.rays.core.ray_tracer import dr, mi, rt
from simulate.spectra.element_array import array_of

DIPOLES = ("dipole", "hw_dipole")

LYING = Rotation.from_euler("x", -90, degrees=True)  # Turns a dipole from +z to +y of Sionna's frame


def build_scene(scene: Scene) -> rt.Scene:
    """Build a scene's meshes and radio materials in Sionna RT."""
    sionna = rt.Scene()
    sionna.frequency = scene.frequency
    materials: dict[tuple[str, float], rt.RadioMaterial] = {}
    objects = []
    for number, item in enumerate(scene.objects):
        material = scene.materials[item.material]
        thickness = scene.thickness(item)
        key = (item.material, thickness)
        if key not in materials:
            materials[key] = _radio_material(f"{item.material}-{thickness:g}", material, thickness)
        name = f"object-{number}"  # Sionna RT allows no dots, as in Blender's Cube.001
        objects.append(rt.SceneObject(mi_mesh=_mesh(name, item.mesh), name=name, radio_material=materials[key]))
    sionna.edit(add=objects)
    return sionna


@dataclass(frozen=True)
class Antennas:
    """One end of the paths: antennas of one pattern and orientation at given positions."""

    positions: Float[np.ndarray, "n 3"]  # metres, world frame
    angles: Float[np.ndarray, 3]  # Sionna's orientation angles (α, β, γ), radians
    pattern: Callable  # Sionna's antenna pattern, of a single polarisation

    def __len__(self) -> int:
        return len(self.positions)

    def subset(self, index: Int[np.ndarray, " k"]) -> Antennas:
        """The antennas with these indices."""
        return replace(self, positions=self.positions[index])

    @property
    def points(self) -> mi.Point3f:
        """The positions in Sionna's form."""
        return mi.Point3f(np.ascontiguousarray(self.positions.T, dtype=np.float32))

    @property
    def orientations(self) -> mi.Point3f:
        """The angles, repeated for each antenna."""
        return mi.Point3f(np.tile(np.asarray(self.angles, dtype=np.float32)[:, None], len(self)))


def gateway_antennas(scene: Scene) -> Antennas:
    """The gateway's elements at their true positions, in the order of the array."""
    gateway = scene.gateway
    rotation = Rotation.from_quat(gateway.orientation)
    offsets = rotation.apply(array_of(gateway, scene.frequency).positions) * scene.wavelength
    positions, there = np.asarray(gateway.position) + offsets, rotation * GATEWAY_FROM_TRANSMITTER
    return _antennas(positions, there, gateway.pattern, gateway.polarization)


def transmitter_antennas(scene: Scene, positions: Float[np.ndarray, "n 3"]) -> Antennas:
    """The transmitter's antenna at each of its positions."""
    transmitter = scene.transmitter
    rotation = Rotation.from_quat(transmitter.orientation)
    return _antennas(positions, rotation, transmitter.pattern, transmitter.polarization)


def sionna_angles(rotation: Rotation) -> Float[np.ndarray, 3]:
    """Sionna's orientation angles (α, β, γ) about z, y, x, radians, of a device-to-world rotation."""
    with warnings.catch_warnings():
        # If the boresight is straight up or down, α and γ turn about the same axis, and any split of them is right.
        warnings.filterwarnings("ignore", message="Gimbal lock")
        return rotation.as_euler("ZYX")


def _antennas(positions: Float[np.ndarray, "n 3"], rotation: Rotation, pattern: str, polarization: str) -> Antennas:
    """Antennas of a device in Sionna's frame, which looks along +x.

    A dipole that is polarised "H" lies along +y. Sionna would keep the pattern of the upright dipole, and only turn its
    field.
    """
    if pattern in DIPOLES and polarization == "H":
        rotation, polarization = rotation * LYING, "V"
    array = rt.PlanarArray(num_rows=1, num_cols=1, pattern=pattern, polarization=polarization)
    return Antennas(positions, sionna_angles(rotation), array.antenna_pattern.patterns[0])


def _radio_material(name: str, material: RadioMaterial, thickness: float) -> rt.RadioMaterial:
    sionna = rt.RadioMaterial(
        name,
        scattering_coefficient=material.scattering_coefficient,
        xpd_coefficient=material.xpd_coefficient,
        color=material.color,
    )
    # A constant would be part of Dr.Jit's kernels. Every new value would compile them again, which takes a second.
    sionna.thickness = dr.opaque(mi.Float, thickness)
    sionna.relative_permittivity = dr.opaque(mi.Float, material.relative_permittivity)
    sionna.conductivity = dr.opaque(mi.Float, material.conductivity)
    return sionna


def _mesh(name: str, mesh: trimesh.Trimesh) -> mi.Mesh:
    shape = mi.Mesh(name, vertex_count=len(mesh.vertices), face_count=len(mesh.faces))
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = np.asarray(mesh.vertices, dtype=np.float32).ravel()
    parameters["faces"] = np.asarray(mesh.faces, dtype=np.uint32).ravel()
    parameters.update()
    return shape
