"""The description of a scene: a gateway, the region that a transmitter moves in, and objects with radio materials."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from scenes.scene.antennas import Gateway, Transmitter, as_positions
from scenes.scene.connected_parts import Parts, part_meshes, parts_of
from scenes.scene.frequency import read_frequency
from scenes.scene.materials import RadioMaterial, is_conductor, p2040_material, p2040_source

if TYPE_CHECKING:  # loads for half a second, and a dataset needs only its gateway
    from trimesh import Trimesh


SPEED_OF_LIGHT = 299_792_458.0  # Metres per second

LONGEST_NAME = 200  # Most characters in the name of a scene, an object or a material
MOST_TRIANGLES = 2_000_000
"""Most triangles of a scene. The import of 5 million took 85 s and 7 GB on one core; drawing takes 30 µs each."""
FARTHEST = 1e5
"""Largest coordinate, metres. Models compute in single precision, which rounds 100 km to 8 mm."""


@dataclass(frozen=True)
class SceneObject:
    """A triangle mesh with a radio material.

    Each triangle stands for a homogeneous slab. Model a wall or a board as a single sheet (``shapes.sheet``): two
    parallel faces would be traced as two slabs. Two objects are equal if all their attributes are, meshes included.

    Attributes:
        name: name of the object, unique in its scene, 1 to 200 printable characters.
        mesh: the triangles, metres, world frame, z up.
        material: name of the material, a key of ``Scene.materials``.
        thickness: thickness of the slab, metres. None: the thickness of the material.

    Example:
        >>> import bisplat
        >>> mesh = bisplat.shapes.sheet((0, 0, 0), (4, 0, 0), (0, 3, 0))
        >>> floor = bisplat.SceneObject("floor", mesh, "concrete", thickness=0.3)
        >>> float(floor.mesh.area)
        12.0
    """

    name: str
    mesh: Trimesh
    material: str
    thickness: float | None = None

    @cached_property
    def parts(self) -> Parts:
        """The triangles of the mesh by connected parts."""
        return parts_of(self.mesh)

    @cached_property
    def closed_parts(self) -> list[Trimesh]:
        """The closed parts of the mesh, such as boxes. Nothing can be inside of the other parts, which are sheets."""
        return part_meshes(self.mesh, self.parts)

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
    """A gateway, the region that a transmitter moves in, and objects with radio materials.

    A scene is plain, immutable data; ``dataclasses.replace`` makes a changed copy. The constructor checks nothing.
    ``simulate``, ``load_scene``, ``write_scene`` and ``import_scene`` check the values.

    Attributes:
        name: name of the scene.
        frequency: carrier frequency, Hz, from 1 MHz to 1 THz.
        gateway: the receiver.
        transmitter: the transmitter and the region it moves in.
        objects: all objects of the scene, each with a different name.
        materials: the materials of the objects by name, with their properties at the scene's frequency.
        further_gateways: more gateways that receive the same transmitter, by name. Each gets a dataset of its own.

    Example:
        A yard with a concrete floor:

        >>> import bisplat
        >>> mesh = bisplat.shapes.sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0))
        >>> yard = bisplat.Scene(
        ...     name="yard",
        ...     frequency=915e6,
        ...     gateway=bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((-1, 0, 0))),
        ...     transmitter=bisplat.Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2)),
        ...     objects=(bisplat.SceneObject("floor", mesh, "concrete"),),
        ...     materials=bisplat.p2040_materials(["concrete"], 915e6),
        ... )
        >>> round(yard.wavelength, 3), yard.bounds.tolist()
        (0.328, [[-5.0, -5.0, 0.0], [5.0, 5.0, 0.0]])

        The same yard at another frequency, and with another array:

        >>> wifi = yard.at_frequency("2.4 GHz").with_array(8, 8, spacing=0.4)
        >>> round(wifi.wavelength, 3), wifi.gateway.rows
        (0.125, 8)
    """

    name: str
    frequency: float
    gateway: Gateway
    transmitter: Transmitter
    objects: tuple[SceneObject, ...]
    materials: dict[str, RadioMaterial]
    further_gateways: dict[str, Gateway] = field(default_factory=dict)

    def by_gateway(self) -> dict[str, Scene]:
        """Split the scene into one scene for each gateway.

        Returns:
            Scenes with one gateway each, by the name of the gateway. ``gateway`` is named "gateway1" and comes first.

        Example:
            >>> import bisplat
            >>> list(bisplat.load_scene("lab").by_gateway())
            ['gateway1']
        """
        gateways = {"gateway1": self.gateway, **self.further_gateways}
        return {name: replace(self, gateway=gateway, further_gateways={}) for name, gateway in gateways.items()}

    def at_frequency(self, frequency: float | str) -> Scene:
        """Return the same scene at another carrier frequency.

        Materials of ITU-R P.2040 get the values of that frequency. Those with values of their own keep them, and
        ``simulate`` warns of them. Positions and thicknesses stay as they are. The spacing of the elements stays the
        same in wavelengths, and given positions of elements stay the same in metres.

        Args:
            frequency: Hz, or a text with a unit such as "2.4 GHz".

        Returns:
            The changed copy.

        Raises:
            ParameterError: the frequency is not from 1 MHz to 1 THz.
            InputError: ITU-R P.2040 does not give a material at the frequency.

        Example:
            >>> import bisplat
            >>> lab = bisplat.load_scene("lab")
            >>> [round(each.materials["concrete"].conductivity, 3) for each in (lab, lab.at_frequency(2.4e9))]
            [0.043, 0.092]
        """
        frequency = read_frequency(frequency)
        materials = {}
        for name, material in self.materials.items():
            source = p2040_source(material, self.frequency)
            if source is None:
                materials[name] = replace(material, frequency=material.frequency or self.frequency)
            else:
                there = p2040_material(source, frequency)
                values = (there.relative_permittivity, there.conductivity)
                materials[name] = replace(
                    material, relative_permittivity=values[0], conductivity=values[1], frequency=frequency
                )
        return replace(self, frequency=frequency, materials=materials)

    def with_array(self, rows: int, columns: int, spacing: float | None = None) -> Scene:
        """Return the same scene with another array at every gateway.

        Args:
            rows: number of elements along y, 1 to 64.
            columns: number of elements along x, 1 to 64.
            spacing: distance between neighbouring elements, wavelengths. None: as it is.

        Returns:
            The changed copy. ``simulate`` checks the values, as those of every scene.

        Example:
            >>> import bisplat
            >>> gateway = bisplat.load_scene("lab").with_array(8, 8).gateway
            >>> gateway.rows, gateway.columns, gateway.spacing
            (8, 8, 0.5)
        """

        def changed(gateway: Gateway) -> Gateway:
            between = gateway.spacing if spacing is None else spacing
            return replace(gateway, rows=rows, columns=columns, spacing=between, elements=None)

        further = {name: changed(gateway) for name, gateway in self.further_gateways.items()}
        return replace(self, gateway=changed(self.gateway), further_gateways=further)

    def with_elements(self, elements: ArrayLike) -> Scene:
        """Return the same scene with an array of given element positions at every gateway.

        Args:
            elements: position x, y, z of each element, metres, gateway frame, [elements, 3].

        Returns:
            The changed copy. ``simulate`` checks the values, as those of every scene.

        Raises:
            ParameterError: the positions are not rows of three numbers.

        Example:
            >>> import bisplat
            >>> circle = bisplat.ElementArray.circle(8, radius_m=0.16)
            >>> bisplat.load_scene("lab").with_elements(circle.positions_m).gateway.count
            8
        """
        places = as_positions("elements", elements)
        scene = self.with_array(Gateway.rows, Gateway.columns, Gateway.spacing)  # as a gateway with elements has them
        further = {name: replace(gateway, elements=places) for name, gateway in scene.further_gateways.items()}
        return replace(scene, gateway=replace(scene.gateway, elements=places), further_gateways=further)

    @property
    def wavelength(self) -> float:
        """Wavelength λ = c / f, metres."""
        return SPEED_OF_LIGHT / self.frequency

    def thickness(self, item: SceneObject) -> float:
        """Return the thickness of the slab that an object's surfaces stand for.

        Args:
            item: an object of the scene.

        Returns:
            The object's own thickness if it has one, else that of its material, metres.

        Example:
            >>> import bisplat
            >>> lab = bisplat.load_scene("lab")
            >>> {item.name: lab.thickness(item) for item in lab.objects[:3]}
            {'floor': 0.2, 'ceiling': 0.2, 'wall south': 0.12}
        """
        return self.materials[item.material].thickness if item.thickness is None else item.thickness

    @property
    def triangles(self) -> int:
        """Number of triangles of all objects."""
        return sum(len(item.mesh.faces) for item in self.objects)

    @cached_property
    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box around all objects, [2, 3], metres, world frame."""
        low = np.min([item.mesh.bounds[0] for item in self.objects], axis=0)
        high = np.max([item.mesh.bounds[1] for item in self.objects], axis=0)
        bounds = np.stack([low, high])
        bounds.flags.writeable = False  # the array is kept, since drawings ask for it once for each object
        return bounds

    @property
    def extent(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box around all objects, gateways and the transmitter region, [2, 3], metres,
        world frame.
        """
        gateways = [gateway.position for gateway in (self.gateway, *self.further_gateways.values())]
        points = np.vstack([self.bounds, self.transmitter.region, gateways])
        return np.stack([points.min(axis=0), points.max(axis=0)])


def with_same_array(scene: Scene, frequency: float) -> Scene:
    """The scene at another frequency. Its array keeps its size in metres, so its spacing in wavelengths changes."""
    there, own = scene.at_frequency(frequency), scene.gateway
    if own.elements is not None:  # their positions are in metres
        return there
    return replace(there, gateway=replace(own, spacing=own.spacing * frequency / scene.frequency))


def shifted(scene: Scene, step: Float[np.ndarray, " 3"]) -> Scene:
    """Return a scene in which everything is moved by the same step: gateways, transmitter region and objects."""
    from trimesh import Trimesh

    def gateway(old: Gateway) -> Gateway:
        return replace(old, position=tuple(np.asarray(old.position) + step))

    def item(old: SceneObject) -> SceneObject:
        new = replace(old, mesh=Trimesh(old.mesh.vertices + step, old.mesh.faces, process=False))
        vars(new)["parts"] = old.parts  # the same triangles are connected
        return new

    low, high = scene.transmitter.region + step
    return replace(
        scene,
        gateway=gateway(scene.gateway),
        transmitter=replace(scene.transmitter, region_min=tuple(low), region_max=tuple(high)),
        objects=tuple(item(each) for each in scene.objects),
        further_gateways={name: gateway(each) for name, each in scene.further_gateways.items()},
    )


def conducting_objects(scene: Scene) -> Bool[np.ndarray, " objects"]:
    """Whether each object of a scene is a conductor."""
    return np.array([is_conductor(scene.materials[item.material], scene.frequency) for item in scene.objects])
