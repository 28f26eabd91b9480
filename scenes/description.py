"""A scene as data: a gateway that listens, a region a transmitter moves in, objects of radio materials."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.errors import InputError
from scenes.materials import RadioMaterial

SPEED_OF_LIGHT = 299_792_458.0  # m/s
PATTERNS = ("iso", "dipole", "hw_dipole", "tr38901")
POLARIZATIONS = ("V", "H")
UNIT_TOLERANCE = 1e-3  # quaternions are published with a few digits

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def _unit(q: Sequence[float]) -> Quaternion:
    """`q` scaled to length 1 where it nearly is; otherwise as it is, for `validate` to refuse."""
    norm = math.sqrt(sum(c * c for c in q))
    # Within rounding it is left alone, so that a scene read back equals the one written.
    if 1e-12 < abs(norm - 1) <= UNIT_TOLERANCE:
        q = [c / norm for c in q]
    x, y, z, w = (float(c) for c in q)
    return x, y, z, w


def facing(boresight: Vector3) -> Quaternion:
    """Orientation of a gateway that looks along `boresight`, its y axis as far up (world +z) as that allows.

    Looking straight up or down, its y axis is along world +y.

    Raises:
        InputError: a boresight of length zero.

    >>> [round(c, 3) for c in facing((0.0, 0.0, 1.0))]
    [0.0, 0.0, 0.0, 1.0]
    """
    length = float(np.linalg.norm(boresight))
    if not (math.isfinite(length) and length > 0):
        raise InputError(f"boresight: expected a direction, found {list(boresight)}")
    z = np.asarray(boresight) / length
    up = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 1 - 1e-9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    q = Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=1)).as_quat()
    return float(q[0]), float(q[1]), float(q[2]), float(q[3])


@dataclass(frozen=True)
class Gateway:
    """The receiver: a uniform planar array at a fixed place.

    In the gateway's frame the array lies in the x–y plane, centred on the origin, boresight +z. Element
    m = row·columns + column sits at spacing·λ·(column − (columns−1)/2, row − (rows−1)/2, 0): x runs fastest.
    Polarisation "V" is along the gateway's +y, "H" along its +x, so a gateway on a wall has its y axis up,
    as NeRF²'s has.
    """

    position: Vector3  # m, world
    orientation: Quaternion  # unit, (x, y, z, w), gateway frame to world, as scipy's Rotation.from_quat
    rows: int = 4
    columns: int = 4
    spacing: float = 0.5  # wavelengths
    pattern: str = "iso"
    polarization: str = "V"

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", tuple(map(float, self.position)))
        object.__setattr__(self, "orientation", _unit(self.orientation))


@dataclass(frozen=True)
class Transmitter:
    """The moving transmitter: a single antenna anywhere in an axis-aligned box.

    Its frame is Sionna RT's: "V" is along its +z, which is world +z for the identity orientation.
    """

    region_min: Vector3  # m, world
    region_max: Vector3  # m, world
    pattern: str = "iso"
    polarization: str = "V"
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)  # unit, (x, y, z, w), transmitter frame to world

    def __post_init__(self) -> None:
        for corner in ("region_min", "region_max"):
            object.__setattr__(self, corner, tuple(map(float, getattr(self, corner))))
        object.__setattr__(self, "orientation", _unit(self.orientation))

    def corners(self) -> Float[np.ndarray, "8 3"]:
        """The corners of the region [m]."""
        axes = zip(self.region_min, self.region_max, strict=True)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(8, 3)


@dataclass(frozen=True)
class SceneObject:
    """A triangle mesh in world metres, z up, of one radio material."""

    name: str
    mesh: Trimesh
    material: str
    thickness: float | None = None  # m; overrides the material's

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
    """A place. `materials` holds every material an object is made of, at the scene's frequency.

    `further_gateways` see the same transmitters, each in a dataset of its own: `by_gateway` lists them all.
    """

    name: str
    frequency: float  # Hz
    gateway: Gateway
    transmitter: Transmitter
    objects: tuple[SceneObject, ...]
    materials: dict[str, RadioMaterial]
    further_gateways: dict[str, Gateway] = field(default_factory=dict)

    def by_gateway(self) -> dict[str, Scene]:
        """The place as each gateway has it; the first is "gateway1"."""
        gateways = {"gateway1": self.gateway, **self.further_gateways}
        return {name: replace(self, gateway=gateway, further_gateways={}) for name, gateway in gateways.items()}

    @property
    def wavelength(self) -> float:
        """λ = c / f [m]."""
        return SPEED_OF_LIGHT / self.frequency

    @property
    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of all objects [m]."""
        low = np.min([o.mesh.bounds[0] for o in self.objects], axis=0)
        high = np.max([o.mesh.bounds[1] for o in self.objects], axis=0)
        return np.stack([low, high])
