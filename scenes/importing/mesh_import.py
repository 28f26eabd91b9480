"""Mesh and scene files of other programs, turned into scene objects: units, up axis, names, materials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from trimesh import Trimesh

from scenes.checks.validation import validate
from scenes.files.errors import InputError, did_you_mean, require_positive
from scenes.importing.import_unit import METRES, unit_doubt
from scenes.importing.mesh_files import MESH_SUFFIXES, default_up, read_meshes
from scenes.importing.mitsuba_xml import SIONNA, read_mitsuba, sionna_scene
from scenes.scene.description import LONGEST_NAME, Gateway, Scene, SceneObject, Transmitter
from scenes.scene.materials import RadioMaterial, material_names, p2040_materials

# (x, y, z) -> (x, -z, y)
Y_UP_TO_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
DEFAULT_FREQUENCY = 915e6
"""Hz; neither a mesh nor a scene XML has one."""
SLIVER = 1e-6
"""Metres; a triangle less than this high has no well-defined normal, so nothing can be reflected off it."""
LISTED = 8
"""Names that a message lists at most."""


@dataclass(frozen=True)
class ImportReport:
    """Sizes of imported objects, the triangles that were dropped, and what may be a mistake.

    Attributes:
        sizes: metres along x, y and z, by the object's name.
        degenerate: number of triangles without area that were dropped, by the name of each object that had any.
        warnings: a sentence for each thing that may be a mistake: a material rule that matches nothing, a unit by which
            the place is much larger or smaller than what happens in it.
    """

    sizes: dict[str, tuple[float, float, float]]
    degenerate: dict[str, int]
    warnings: tuple[str, ...] = ()


def is_importable(name: str) -> bool:
    """Whether ``import_scene`` reads files of this name: a mesh, a scene XML, or "sionna:" and a name."""
    return name.startswith(SIONNA) or Path(name).suffix.lower() in (*MESH_SUFFIXES, ".xml")


def plain_name(name: str) -> str:
    r"""A name that a scene may have: unprintable characters become "_", a long name is cut, none is "unnamed".

    Args:
        name: as a file of another program has it.

    >>> plain_name("Wand\n2"), plain_name("")
    ('Wand_2', 'unnamed')
    """
    return "".join(c if c.isprintable() else "_" for c in name[:LONGEST_NAME]) or "unnamed"


def _material_of(name: str, stem: str, materials: Sequence[tuple[str, str]], default: str | None) -> str | None:
    """Material of the first pattern that matches the node's name, or else the file's name."""
    for candidate in (name, stem):
        for pattern, material in materials:
            if fnmatchcase(candidate, pattern):
                return material
    return default


def _idle_rules(path: Path, names: Sequence[str], materials: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """A warning for each pattern that matches neither an object's name nor the file's."""
    idle = [rule for rule in materials if not any(fnmatchcase(name, rule[0]) for name in (*names, path.stem))]
    return tuple(
        f'{path}: the material rule "{pattern}={material}" matches no object; the objects are {_list(names)}'
        for pattern, material in idle
    )


def _list(names: Iterable[str]) -> str:
    """Names, each once, the first ``LISTED`` of them."""
    each = list(dict.fromkeys(names))
    rest = f" and {len(each) - LISTED} more" if len(each) > LISTED else ""
    return ", ".join(each[:LISTED]) + rest


def import_mesh(
    path: str | Path,
    materials: Sequence[tuple[str, str]],
    default_material: str | None = None,
    unit: str = "m",
    up: str | None = None,
) -> tuple[list[SceneObject], ImportReport]:
    """Read GLB/GLTF (an object per node), OBJ (per ``o`` and ``g``), PLY, STL or OFF (one) into world metres.

    Args:
        path: the mesh file.
        materials: (glob pattern, material) pairs; the first pattern that matches an object's name, and then
            the first that matches the file's name without its ending, gives its material.
        default_material: for objects that nothing matches.
        unit: the file's unit: m, cm, mm, in or ft.
        up: the file's vertical axis, "y" or "z"; without it "y" for glTF, as its specification says, else
            "z". A y-up file is rotated by +90° about x: (x, y, z) becomes (x, −z, y).

    Returns:
        The objects in order of their names, repeated names numbered, and what was found on the way.

    Raises:
        InputError: a file ``read_meshes`` refuses, an unknown unit, axis or material, objects without a
            material, or an object of which no triangle has any area.
    """
    path = Path(path)
    _check_options(path, materials, default_material, unit, up)
    meshes = [(plain_name(name), mesh) for name, mesh in read_meshes(path)]
    chosen = {name: _material_of(name, path.stem, materials, default_material) for name, _ in meshes}
    unmatched = [name for name, material in chosen.items() if material is None]
    if unmatched:
        rule = f"{unmatched[0]}=MATERIAL"
        raise InputError(f"{path}: no material for {_list(unmatched)}; add a pattern ({rule}) or a default material")
    objects, report = _objects(path, [(name, mesh, chosen[name] or "") for name, mesh in meshes], unit, up)
    return objects, replace(report, warnings=_idle_rules(path, list(chosen), materials))


def import_mitsuba(
    path: Path,
    frequency: float,
    materials: Sequence[tuple[str, str]] = (),
    default_material: str | None = None,
    unit: str = "m",
    up: str | None = None,
) -> tuple[list[SceneObject], dict[str, RadioMaterial], ImportReport]:
    """Read a scene file of Mitsuba 3 or Sionna RT (an object per shape) into world metres.

    Args:
        path: the scene file.
        frequency: hertz.
        materials: (glob pattern, material) pairs; the first pattern that matches a shape's name, or else the first that
            matches the file's name without its ending, takes precedence over the file's own material.
        default_material: for shapes that neither a pattern nor the file gives a radio material.
        unit: the file's unit: m, cm, mm, in or ft.
        up: the file's vertical axis, "y" or "z" (the default).

    Returns:
        The objects in the order of the file, the materials they are made of, and what was found on the way.

    Raises:
        InputError: as ``read_mitsuba``, ``MitsubaShape.radio_material`` and ``import_mesh``.
    """
    _check_options(path, materials, default_material, unit, up)
    shapes = [replace(shape, name=plain_name(shape.name)) for shape in read_mitsuba(path)]
    chosen = [_material_of(shape.name, path.stem, materials, None) for shape in shapes]
    # These first, so that a material of P.2040 keeps its name even where the file has one of that name.
    resolved = p2040_materials((name for name in chosen if name), frequency)
    named = []
    for shape, ruled in zip(shapes, chosen, strict=True):
        name = ruled or _name_in(resolved, shape.radio_material(frequency, default_material))
        named.append((shape.name, shape.mesh, name))
    objects, report = _objects(path, named, unit, up)
    report = replace(report, warnings=_idle_rules(path, [shape.name for shape in shapes], materials))
    return objects, resolved, report


def _name_in(materials: dict[str, RadioMaterial], material: RadioMaterial) -> str:
    """The material's name among ``materials``, where it is added; numbered if another one has its name."""
    material = replace(material, name=plain_name(material.name))
    name, count = material.name, 1
    while materials.setdefault(name, named := replace(material, name=name)) != named:
        count += 1
        name = f"{material.name}_{count}"
    return name


def _check_options(
    path: Path, materials: Sequence[tuple[str, str]], default_material: str | None, unit: str, up: str | None
) -> None:
    if unit not in METRES:
        raise InputError(f'{path}: unknown unit "{unit}"; {did_you_mean(unit, METRES)}')
    if up not in (None, "y", "z"):
        raise InputError(f'{path}: up must be "y" or "z", found "{up}"')
    for material in (*(m for _, m in materials), default_material):
        if material is not None and material not in material_names():
            suggestion = did_you_mean(material, material_names())
            raise InputError(f'{path}: unknown material "{material}"; {suggestion}')


def _objects(
    path: Path, meshes: Sequence[tuple[str, Trimesh, str]], unit: str, up: str | None
) -> tuple[list[SceneObject], ImportReport]:
    """Name, mesh and material of each object, into world metres; repeated names are numbered."""
    to_world = np.diag([METRES[unit]] * 3 + [1.0])
    if (up or default_up(path)) == "y":
        to_world = Y_UP_TO_Z_UP @ to_world
    objects, degenerate = [], {}
    names, used, seen = {name for name, _, _ in meshes}, set(), Counter[str]()
    for name, mesh, material in meshes:
        unique = name
        while unique in used or (unique != name and unique in names):
            seen[name] += 1
            unique = f"{name}_{seen[name] + 1}"
        used.add(unique)
        mesh = Trimesh(mesh.vertices, mesh.faces, process=False).apply_transform(to_world)
        mesh.merge_vertices()  # corners split by normals or textures would leave a closed shell open
        keep = mesh.nondegenerate_faces(height=SLIVER)
        if not keep.any():
            raise InputError(f'{path}: "{unique}" has no triangle with an area; is the unit really {unit}?')
        if not keep.all():
            degenerate[unique] = int(np.count_nonzero(~keep))
            mesh.update_faces(keep)
            mesh.remove_unreferenced_vertices()
        objects.append(SceneObject(unique, mesh, material))
    sizes = {o.name: _size(o.mesh) for o in objects}
    return objects, ImportReport(sizes, degenerate)


def import_scene(
    path: Path | str,
    materials: Sequence[tuple[str, str]] = (),
    default_material: str | None = None,
    unit: str = "m",
    up: str | None = None,
    frequency: float = DEFAULT_FREQUENCY,
    *,
    gateway: Gateway,
    transmitter: Transmitter,
) -> tuple[Scene, ImportReport]:
    """Make a scene of a mesh or scene file, named for it, with a gateway and a transmitter region.

    Args:
        path: a mesh, a Mitsuba or Sionna RT scene XML, or "sionna:" and the name of one of Sionna RT's own scenes.
        materials: rules (node's name with * and ?, material); the first that matches counts.
        default_material: the material of nodes that neither a rule nor the file gives one.
        unit: the file's unit of length: m, cm, mm, in or ft.
        up: the file's vertical axis, "y" or "z"; None: y for glTF, else z.
        frequency: Hz.
        gateway: the receiver, in world metres (after unit and axes are converted).
        transmitter: the transmitter and its region, in world metres.

    Returns:
        The scene, and what was found on the way.

    Raises:
        InputError: a file that cannot be read, a node without a material, a material unknown at the frequency, a unit
            that cannot be right, or a scene that ``scenes.checks.validation.validate`` refuses.
        ParameterError: the frequency is not positive.

    >>> import bisplat, tempfile
    >>> gateway = bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((1, 0, 0)))
    >>> transmitter = bisplat.Transmitter(region_min=(1, -1, 0.5), region_max=(3, 1, 1.5))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = bisplat.shapes.sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)).export(f"{folder}/yard.ply")
    ...     scene, report = import_scene(
    ...         f"{folder}/yard.ply", [("yard", "concrete")], gateway=gateway, transmitter=transmitter
    ...     )
    >>> scene.name, [(item.name, item.material) for item in scene.objects]
    ('yard', [('yard', 'concrete')])
    """
    require_positive(frequency=frequency)
    path = sionna_scene(str(path)) if str(path).startswith(SIONNA) else Path(path)
    if path.suffix.lower() == ".xml":
        objects, resolved, report = import_mitsuba(path, frequency, materials, default_material, unit, up)
    else:
        objects, report = import_mesh(path, materials, default_material, unit, up)
        resolved = p2040_materials((item.material for item in objects), frequency)
    scene = Scene(plain_name(path.stem), frequency, gateway, transmitter, tuple(objects), resolved)
    # Before other checks, which would find fault with a gateway that is right in a place of the wrong size.
    doubt = unit_doubt(scene.bounds, np.vstack([gateway.position, transmitter.corners()]), unit, scene.wavelength)
    if doubt is not None and doubt.impossible:
        raise InputError(f"{path}: {doubt.sentence}")
    validate(scene, str(path))
    for sentence in (doubt.sentence if doubt else None, _beside(scene)):
        if sentence is not None:
            report = replace(report, warnings=(*report.warnings, f"{path}: {sentence}"))
    return scene, report


def _beside(scene: Scene) -> str | None:
    """A warning where the gateway or the whole region is beside the place; above it they may well be."""
    (low, high), transmitter = scene.bounds[:, :2], scene.transmitter
    spans = {
        "gateway": (scene.gateway.position[:2], scene.gateway.position[:2]),
        "transmitter region": (transmitter.region_min[:2], transmitter.region_max[:2]),
    }
    beside = [name for name, (least, most) in spans.items() if np.any(most < low) or np.any(least > high)]
    if not beside:
        return None
    return (
        f"expected the gateway and the transmitter region in the place, which is at x {low[0]:.3g} to {high[0]:.3g} "
        f"and y {low[1]:.3g} to {high[1]:.3g} m, found the {' and the '.join(beside)} beside it; is the up axis right?"
    )


def _size(mesh: Trimesh) -> tuple[float, float, float]:
    x, y, z = (float(e) for e in mesh.extents)
    return x, y, z
