"""Import mesh and scene files of other programs: convert units and axes, and assign names and materials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from trimesh import Trimesh

from scenes.checks.validation import validate
from scenes.files.errors import InputError, did_you_mean, named, require_positive
from scenes.importing.import_unit import METRES, unit_doubt
from scenes.importing.mesh_files import MESH_SUFFIXES, default_up, read_mesh_file
from scenes.importing.mitsuba_xml import SIONNA, read_mitsuba, sionna_scene
from scenes.scene.description import LONGEST_NAME, Gateway, Scene, SceneObject, Transmitter
from scenes.scene.materials import RadioMaterial, material_names, p2040_materials

# (x, y, z) -> (x, -z, y)
Y_UP_TO_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
DEFAULT_FREQUENCY = 915e6
"""Hz. Neither a mesh nor a scene XML has a frequency."""
SLIVER = 1e-6
"""Smallest height of a triangle, metres. A smaller one has no well-defined normal, so it cannot reflect."""
LISTED = 8
"""Most names that a message lists."""


@dataclass(frozen=True)
class ImportReport:
    """Summary of an import: sizes, dropped triangles, and warnings.

    Attributes:
        sizes: size of each object along x, y and z, metres, by name.
        degenerate: number of triangles without area that were dropped, by name of the object. Objects without such
            triangles are left out.
        warnings: sentences about possible mistakes, such as a material rule that matches no object, or a unit with
            which the scene is much larger or smaller than the space between gateway and transmitter.
    """

    sizes: dict[str, tuple[float, float, float]]
    degenerate: dict[str, int]
    warnings: tuple[str, ...] = ()


def is_importable(name: str) -> bool:
    """Whether ``import_scene`` reads this: a mesh, a scene XML, or "sionna:" and a name."""
    return name.startswith(SIONNA) or Path(name).suffix.lower() in (*MESH_SUFFIXES, ".xml")


def plain_name(name: str) -> str:
    r"""Make a name valid for a scene: replace unprintable characters by "_", cut a long name, name what has none.

    Args:
        name: the name in a file of another program.

    >>> plain_name("Wand\n2"), plain_name("")
    ('Wand_2', 'unnamed')
    """
    return "".join(c if c.isprintable() else "_" for c in name[:LONGEST_NAME]) or "unnamed"


def _material_of(name: str, stem: str, materials: Sequence[tuple[str, str]], default: str | None) -> str | None:
    """Return the material of the first pattern that matches the node's name or, failing that, the file's name."""
    for candidate in (name, stem):
        for pattern, material in materials:
            if fnmatchcase(candidate, pattern):
                return material
    return default


def _idle_rules(path: Path, names: Sequence[str], materials: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Return a warning for each pattern that matches neither the name of an object nor that of the file."""
    idle = [rule for rule in materials if not any(fnmatchcase(name, rule[0]) for name in (*names, path.stem))]
    return tuple(
        f'{path}: the material rule "{pattern}={material}" matches no object; the objects are {_list(names)}'
        for pattern, material in idle
    )


def _list(names: Iterable[str]) -> str:
    """List the first ``LISTED`` names, without repetitions."""
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
    """Read the objects of a mesh file and convert them to metres in the world frame.

    A GLB or GLTF file has an object per node, an OBJ file one per ``o`` and ``g``, and a PLY, STL or OFF file a single
    object.

    Args:
        path: the mesh file.
        materials: pairs of a glob pattern and a material. An object gets the material of the first pattern that matches
            its name. If none does, the first pattern that matches the file's name without its suffix counts.
        default_material: the material of objects that no pattern matches.
        unit: the file's unit: m, cm, mm, in or ft.
        up: the file's vertical axis, "y" or "z". None: "y" for glTF, as in its specification, else "z". A file with y
            up is rotated by +90° about x: (x, y, z) becomes (x, −z, y).

    Returns:
        The objects in the order of their names, with repeated names numbered, and the report.

    Raises:
        InputError: ``read_mesh_file`` refuses the file, the unit, the axis or a material is unknown, an object has no
            material, or no triangle of an object has an area.
    """
    path = Path(path)
    _check_options(path, materials, default_material, unit, up)
    meshes = [(plain_name(part.name), part.mesh) for part in read_mesh_file(path).parts]
    chosen = {name: _material_of(name, path.stem, materials, default_material) for name, _ in meshes}
    unmatched = [name for name, material in chosen.items() if material is None]
    if unmatched:
        raise InputError(
            f"{path}: expected a material for every object, found none for {_list(unmatched)}; add a rule such as "
            f"{unmatched[0]}=MATERIAL, or a default material"
        )
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
    """Read the shapes of a Mitsuba 3 or Sionna RT scene file and convert them to metres in the world frame.

    Args:
        path: the scene file.
        frequency: Hz.
        materials: pairs of a glob pattern and a material, as in ``import_mesh``. They take precedence over the
            materials in the file.
        default_material: the material of shapes for which neither a pattern nor the file has a radio material.
        unit: the file's unit: m, cm, mm, in or ft.
        up: the file's vertical axis, "y" or "z" (the default).

    Returns:
        The objects in the order of the file, their materials by name, and the report.

    Raises:
        InputError: ``read_mitsuba`` refuses the file, ``MitsubaShape.radio_material`` refuses a material, or
            ``import_mesh`` would refuse the arguments or an object.
    """
    _check_options(path, materials, default_material, unit, up)
    shapes = [replace(shape, name=plain_name(shape.name)) for shape in read_mitsuba(path)]
    chosen = [_material_of(shape.name, path.stem, materials, None) for shape in shapes]
    # These first, so that a material of P.2040 keeps its name even if the file has another one of that name.
    resolved = p2040_materials((name for name in chosen if name), frequency)
    named = []
    for shape, ruled in zip(shapes, chosen, strict=True):
        name = ruled or _name_in(resolved, shape.radio_material(frequency, default_material))
        named.append((shape.name, shape.mesh, name))
    objects, report = _objects(path, named, unit, up)
    report = replace(report, warnings=_idle_rules(path, [shape.name for shape in shapes], materials))
    return objects, resolved, report


def _name_in(materials: dict[str, RadioMaterial], material: RadioMaterial) -> str:
    """Add a material to ``materials`` and return its name there, numbered if another material has the same name."""
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
        raise InputError(f"{path}: unknown unit {named(unit)}; {did_you_mean(unit, METRES)}")
    if up not in (None, "y", "z"):
        raise InputError(f'{path}: up: expected "y" or "z", found {named(up)}')
    for material in (*(m for _, m in materials), default_material):
        if material is not None and material not in material_names():
            suggestion = did_you_mean(material, material_names())
            raise InputError(f"{path}: unknown material {named(material)}; {suggestion}")


def _objects(
    path: Path, meshes: Sequence[tuple[str, Trimesh, str]], unit: str, up: str | None
) -> tuple[list[SceneObject], ImportReport]:
    """Convert named meshes with their materials to objects in metres, world frame, with repeated names numbered."""
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
        mesh.merge_vertices()  # a closed shell would be open where its corners are split by normals or textures
        keep = mesh.nondegenerate_faces(height=SLIVER)
        if not keep.any():
            raise InputError(
                f"{path}: {named(unique)}: expected a triangle with an area, found none; is the unit really {unit}?"
            )
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
    """Import a mesh or scene file of another program as a scene.

    The file has the objects; you give the gateway and the transmitter. GLB/GLTF, OBJ, PLY, STL and OFF meshes and scene
    XML files of Mitsuba 3 or Sionna RT [hoydis2023] can be imported. The scene gets the name of the file. Nothing is
    written; ``write_scene`` saves the scene.

    A GLB or GLTF file has an object per node, an OBJ file one per ``o`` and ``g``, and a scene XML one per shape. Other
    meshes are a single object. Triangles without area are dropped.

    Args:
        path: the file, or "sionna:" and the name of a scene that comes with Sionna RT, such as "sionna:etoile".
        materials: rules, each a pair of a pattern with ``*`` and ``?`` and a material from ``material_names()``. An
            object gets the material of the first rule that matches its name. If none does, the first rule that matches
            the file's name without its suffix counts. Rules take precedence over the materials in a scene XML.
        default_material: the material of objects that have none from a rule or from a scene XML.
        unit: the file's unit of length: "m", "cm", "mm", "in" or "ft".
        up: the file's vertical axis, "y" or "z". None: "y" for glTF, else "z". A file with y up is rotated by +90°
            about x.
        frequency: carrier frequency, Hz.
        gateway: the receiver, in metres, world frame (after the conversion of unit and axes).
        transmitter: the transmitter and its region, in metres, world frame.

    Returns:
        The scene, and a report with ``sizes`` (metres along x, y and z, by name of the object), ``degenerate`` (number
        of dropped triangles, by name of the object) and ``warnings`` (sentences about possible mistakes).

    Raises:
        InputError: the file cannot be read, an object has no material, a material is unknown at the frequency, the unit
            cannot be right, or the scene has an invalid value.
        ParameterError: the frequency is not positive.

    Example:
        >>> import bisplat
        >>> _ = bisplat.shapes.box((0, 0, 0), (4000, 3000, 100)).export("yard.ply")  # in millimetres
        >>> scene, report = bisplat.import_scene(
        ...     "yard.ply",
        ...     materials=[("yard", "concrete")],
        ...     unit="mm",
        ...     gateway=bisplat.Gateway(position=(0.5, 1.5, 1.5), orientation=bisplat.facing((1, 0, 0))),
        ...     transmitter=bisplat.Transmitter(region_min=(2, 1, 0.5), region_max=(3, 2, 1.5)),
        ... )
        >>> scene.objects[0].material, report.sizes, report.warnings
        ('concrete', {'yard': (4.0, 3.0, 0.1)}, ())
    """
    require_positive(frequency=frequency)
    path = sionna_scene(str(path)) if str(path).startswith(SIONNA) else Path(path)
    if path.suffix.lower() == ".xml":
        objects, resolved, report = import_mitsuba(path, frequency, materials, default_material, unit, up)
    else:
        objects, report = import_mesh(path, materials, default_material, unit, up)
        resolved = p2040_materials((item.material for item in objects), frequency)
    scene = Scene(plain_name(path.stem), frequency, gateway, transmitter, tuple(objects), resolved)
    # Before other checks: if the scene has the wrong size, they would blame the gateway.
    doubt = unit_doubt(scene.bounds, np.vstack([gateway.position, transmitter.corners()]), unit, scene.wavelength)
    if doubt is not None and doubt.impossible:
        raise InputError(f"{path}: {doubt.sentence}")
    validate(scene, str(path))
    for sentence in (doubt.sentence if doubt else None, _beside(scene)):
        if sentence is not None:
            report = replace(report, warnings=(*report.warnings, f"{path}: {sentence}"))
    return scene, report


def _beside(scene: Scene) -> str | None:
    """Return a warning if the gateway or the whole region is horizontally outside the scene. They may be above it."""
    (low, high), transmitter = scene.bounds[:, :2], scene.transmitter
    spans = {
        "gateway": (scene.gateway.position[:2], scene.gateway.position[:2]),
        "transmitter region": (transmitter.region_min[:2], transmitter.region_max[:2]),
    }
    beside = [name for name, (least, most) in spans.items() if np.any(most < low) or np.any(least > high)]
    if not beside:
        return None
    return (
        f"expected the gateway and the transmitter region within the scene, x {low[0]:.3g} to {high[0]:.3g} m and y "
        f"{low[1]:.3g} to {high[1]:.3g} m, found the {' and the '.join(beside)} outside it; is the up axis right?"
    )


def _size(mesh: Trimesh) -> tuple[float, float, float]:
    x, y, z = (float(e) for e in mesh.extents)
    return x, y, z
