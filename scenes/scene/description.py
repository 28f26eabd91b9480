"""A scene as data: a gateway that receives, a region that a transmitter moves in, objects of radio materials."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.files.errors import InputError, shown
from scenes.scene.materials import RadioMaterial

SPEED_OF_LIGHT = 299_792_458.0
"""Metres per second."""

PATTERNS = ("iso", "dipole", "hw_dipole", "tr38901")
POLARIZATIONS = ("V", "H")
LOWEST_FREQUENCY, HIGHEST_FREQUENCY = 1e6, 1e12
"""Hertz. Below, wavelengths are longer than 300 m; above, waves are light, and surfaces are rough to them."""
MOST_IN_A_ROW, MOST_ELEMENTS = 64, 1024
"""Of an array. Models, fits and fields take memory in proportion to the elements or to their square."""
WIDEST_SPACING = 100.0
"""Wavelengths between the elements of an array."""
LONGEST_NAME = 200
"""Characters of the name of a scene, an object or a material."""
MOST_TRIANGLES = 2_000_000
"""Of a scene. On one core 5 million were imported in 85 s, with 7 GB, and a triangle takes 30 µs to draw."""
FARTHEST = 1e5
"""Metres; the largest coordinate. Rays are traced in single precision, which rounds 100 km to 8 mm."""
UNIT_TOLERANCE = 1e-3
"""How far a quaternion's length may be from 1; quaternions are published with a few digits."""

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def _unit(orientation: Sequence[float]) -> Quaternion:
    """A quaternion scaled to length 1 where its length is nearly 1; others are left for ``validate`` to refuse."""
    norm = math.sqrt(sum(component * component for component in orientation))
    # A length of 1 within rounding is left alone, so that a scene read back equals the one written.
    if 1e-12 < abs(norm - 1) <= UNIT_TOLERANCE:
        orientation = [component / norm for component in orientation]
    x, y, z, w = (float(component) for component in orientation)
    return x, y, z, w


def facing(boresight: Vector3) -> Quaternion:
    """Orientation of a gateway whose +z points along a boresight, its y axis as far up (world +z) as that allows.

    Where the boresight is straight up or down, the gateway's y axis is along world +y.

    Args:
        boresight: direction in the world frame, of any length.

    Returns:
        Unit quaternion (x, y, z, w), gateway frame to world.

    Raises:
        InputError: a boresight of length zero, or one that is not finite.

    >>> [round(c, 3) for c in facing((0.0, 0.0, 1.0))]
    [0.0, 0.0, 0.0, 1.0]
    """
    length = float(np.linalg.norm(boresight))
    if not (math.isfinite(length) and length > 0):
        raise InputError(f"boresight: expected a direction, found {shown(list(boresight))}")
    z = np.asarray(boresight) / length
    up = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 1 - 1e-9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    q = Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=1)).as_quat()
    return float(q[0]), float(q[1]), float(q[2]), float(q[3])


def boresight_of(orientation: Sequence[float] | Float[np.ndarray, " 4"]) -> Float[np.ndarray, " 3"]:
    """The direction that a gateway of an orientation looks in.

    Args:
        orientation: unit quaternion (x, y, z, w), gateway frame to world.

    Returns:
        Unit vector of the gateway's +z in the world frame.

    >>> boresight_of(facing((0.0, -2.0, 0.0))).round(6).tolist()
    [0.0, -1.0, 0.0]
    """
    return Rotation.from_quat(orientation).apply([0, 0, 1])


@dataclass(frozen=True)
class Gateway:
    """The receiver: a uniform planar array at a fixed place.

    In the gateway's frame the array lies in the x–y plane, centred on the origin, boresight +z. Element
    m = row · columns + column sits at spacing · λ · (column − (columns−1)/2, row − (rows−1)/2, 0): x runs fastest.
    Polarisation "V" is along the gateway's +y, "H" along its +x, so a gateway on a wall has its y axis up,
    as NeRF²'s has.

    Attributes:
        position: metres, world frame.
        orientation: unit quaternion (x, y, z, w), gateway frame to world, as scipy's ``Rotation.from_quat`` reads it.
        rows: number of elements along y.
        columns: number of elements along x.
        spacing: distance between neighbouring elements, wavelengths.
        pattern: element response: "iso", "dipole", "hw_dipole" or "tr38901".
        polarization: "V" or "H".

    >>> gateway = Gateway(position=(0, 0, 1.5), orientation=facing((-1, 0, 0)), rows=2)
    >>> gateway.rows * gateway.columns, gateway.boresight.round(6).tolist()
    (8, [-1.0, 0.0, 0.0])
    """

    position: Vector3
    orientation: Quaternion
    rows: int = 4
    columns: int = 4
    spacing: float = 0.5
    pattern: str = "iso"
    polarization: str = "V"

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", tuple(map(float, self.position)))
        object.__setattr__(self, "orientation", _unit(self.orientation))

    @property
    def boresight(self) -> Float[np.ndarray, " 3"]:
        """The direction the gateway looks in, a unit vector in the world frame."""
        return boresight_of(self.orientation)


@dataclass(frozen=True)
class Transmitter:
    """The moving transmitter: a single antenna anywhere in an axis-aligned box.

    Its frame is Sionna RT's: "V" is along its +z, which is world +z for the identity orientation.

    Attributes:
        region_min: lowest corner of the box, metres, world frame.
        region_max: highest corner of the box, metres, world frame.
        pattern: antenna response: "iso", "dipole", "hw_dipole" or "tr38901".
        polarization: "V" or "H".
        orientation: unit quaternion (x, y, z, w), transmitter frame to world.

    >>> Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2)).region.tolist()
    [[-4.0, -1.0, 0.5], [-2.0, 1.0, 2.0]]
    """

    region_min: Vector3
    region_max: Vector3
    pattern: str = "iso"
    polarization: str = "V"
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        for corner in ("region_min", "region_max"):
            object.__setattr__(self, corner, tuple(map(float, getattr(self, corner))))
        object.__setattr__(self, "orientation", _unit(self.orientation))

    @property
    def region(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box, metres, world frame."""
        return np.array([self.region_min, self.region_max])

    def corners(self) -> Float[np.ndarray, "8 3"]:
        """All corners of the box, metres, world frame."""
        axes = zip(self.region_min, self.region_max, strict=True)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(8, 3)


@dataclass(frozen=True)
class SceneObject:
    """A triangle mesh of one radio material.

    Attributes:
        name: unique in its scene.
        mesh: metres, world frame, z up.
        material: a key of the scene's materials.
        thickness: thickness of the slab that a surface stands for, metres; the material's if None.

    >>> import bisplat
    >>> floor = SceneObject("floor", bisplat.shapes.sheet((0, 0, 0), (4, 0, 0), (0, 3, 0)), "concrete", thickness=0.3)
    >>> float(floor.mesh.area)
    12.0
    """

    name: str
    mesh: Trimesh
    material: str
    thickness: float | None = None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SceneObject):
            return NotImplemented
        return (
            (self.name, self.material, self.thickness) == (other.name, other.material, other.thickness)
            and np.array_equal(self.mesh.vertices, other.mesh.vertices)
            and np.array_equal(self.mesh.faces, other.mesh.faces)
        )


@dataclass(frozen=True)
class Scene:
    """A place: a gateway, the region of a transmitter, and objects of radio materials.

    Attributes:
        name: name of the place.
        frequency: hertz.
        gateway: the receiver.
        transmitter: the transmitter and the region it moves in.
        objects: all objects of the place.
        materials: every material an object is made of, at the scene's frequency, by name.
        further_gateways: gateways that receive the same transmitters, each in a dataset of its own, by name.

    >>> import bisplat
    >>> floor = bisplat.SceneObject("floor", bisplat.shapes.sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete")
    >>> gateway = bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((-1, 0, 0)))
    >>> region = bisplat.Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2))
    >>> materials = bisplat.p2040_materials(["concrete"], 915e6)
    >>> yard = bisplat.Scene("yard", 915e6, gateway, region, (floor,), materials)
    >>> round(yard.wavelength, 3), yard.bounds.tolist()
    (0.328, [[-5.0, -5.0, 0.0], [5.0, 5.0, 0.0]])
    """

    name: str
    frequency: float
    gateway: Gateway
    transmitter: Transmitter
    objects: tuple[SceneObject, ...]
    materials: dict[str, RadioMaterial]
    further_gateways: dict[str, Gateway] = field(default_factory=dict)

    def by_gateway(self) -> dict[str, Scene]:
        """The place once for each gateway, as the only one of its scene; the first is named "gateway1"."""
        gateways = {"gateway1": self.gateway, **self.further_gateways}
        return {name: replace(self, gateway=gateway, further_gateways={}) for name, gateway in gateways.items()}

    @property
    def wavelength(self) -> float:
        """λ = c / f, metres."""
        return SPEED_OF_LIGHT / self.frequency

    def thickness(self, item: SceneObject) -> float:
        """Thickness of an object's slab, metres: its own, or that of its material."""
        return self.materials[item.material].thickness if item.thickness is None else item.thickness

    @property
    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box around all objects, metres, world frame."""
        low = np.min([item.mesh.bounds[0] for item in self.objects], axis=0)
        high = np.max([item.mesh.bounds[1] for item in self.objects], axis=0)
        return np.stack([low, high])

    @property
    def extent(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box around all objects, gateways and the region, metres, world frame."""
        gateways = [gateway.position for gateway in (self.gateway, *self.further_gateways.values())]
        points = np.vstack([self.bounds, self.transmitter.region, gateways])
        return np.stack([points.min(axis=0), points.max(axis=0)])
