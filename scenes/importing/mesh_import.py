"""Import mesh and scene files of other programs as scenes: units, axes, shift, materials, and checks of all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
from jaxtyping import Float

from scenes.checks.validation import validate
from scenes.files.errors import (
    InputError,
    ParameterError,
    check_array,
    require_instance,
    require_path,
    require_within,
    require_word,
    shown,
)
from scenes.files.lengths import METRES
from scenes.files.long_work import doing
from scenes.importing.drawn_walls import Walls, drawn_walls
from scenes.importing.flattening import flattened
from scenes.importing.formats.mesh_part import LARGEST, ImportedFile
from scenes.importing.imported_file import plain_name, read_file
from scenes.importing.imported_objects import ImportReport, import_objects, size_of
from scenes.importing.material_rules import Rule
from scenes.importing.plausibility import antenna_warnings, far_from_origin, unit_doubt
from scenes.importing.up_axis import up_doubt
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene
from scenes.scene.frequency import read_frequency
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import Vector3

DEFAULT_FREQUENCY = 915e6  # Hz. Neither a mesh nor a scene XML has a frequency.


def import_scene(
    path: Path | str,
    materials: Sequence[Rule] = (),
    default_material: str | None = None,
    unit: str = "m",
    up: str | None = None,
    frequency: float | str = DEFAULT_FREQUENCY,
    *,
    gateway: Gateway,
    transmitter: Transmitter,
    shift: Sequence[float] = (0.0, 0.0, 0.0),
    own_materials: Mapping[str, RadioMaterial] | None = None,
    walls: Walls = "as-sheets",
    flatten: float | None = None,
) -> tuple[Scene, ImportReport]:
    """Import a mesh or scene file of another program as a scene.

    The file has the objects; you give the gateway and the transmitter. GLB/GLTF, OBJ, PLY, STL and OFF meshes and scene
    XML files of Mitsuba 3 or Sionna RT [hoydis2023] can be imported. The scene gets the name of the file. Nothing is
    written; ``write_scene`` saves the scene.

    A GLB or GLTF file has an object per node, an OBJ file one per ``o`` and ``g``, and a scene XML one per shape. A
    node or group of several materials has an object per material, such as "Facade/glass". Other meshes are a single
    object. Triangles without area are dropped.

    Args:
        path: the file, or "sionna:" and the name of a scene that comes with Sionna RT, such as "sionna:etoile".
        materials: rules, each a pair of a name, or a pattern with ``*`` and ``?``, and a material from
            ITU-R P.2040 or ``own_materials``. The name may be that of the object, of its node, of its material
            in the file, or of its mesh file; Blender's numbers, such as .001, may be left out. The first rule that
            matches an object counts. If none does, the first rule that matches the file's name without its suffix
            counts. Rules take precedence over the materials that the file names.
        default_material: the material of objects that have none from a rule or from the file. A file names one by a
            radio material (scene XML) or by a name of ITU-R P.2040, such as "Concrete" or "itu_glass".
        unit: the file's unit of length: "m", "cm", "mm", "in" or "ft".
        up: the file's vertical axis, "y" or "z". None: "y" for glTF, else "z"; a file that shows the contrary, such as
            by a floor that stands upright, is refused. A file with y up is rotated by +90° about x.
        frequency: carrier frequency, Hz, or a text with its unit such as "3.5 GHz".
        gateway: the receiver, in metres, world frame (after the conversion of unit and axes, before the shift).
        transmitter: the transmitter and its region, in metres, world frame (likewise).
        shift: what is added to all coordinates x, y, z, also those of the gateway and the region, metres, world frame.
            For files in map coordinates.
        own_materials: materials whose values you give, by name. They take precedence over others of the same name.
        walls: "as-sheets" makes walls and boards that are drawn with both faces, at most twice as far apart as the slab
            of their material is thick, one sheet each, whose slab is as thick as they are. "as-drawn" keeps both faces,
            and waves pass a slab at each.
        flatten: metres within which noisy, finely meshed surfaces are flat, so that they become planes, and their small
            holes are filled. None: a sixteenth of the wavelength, at most 5 cm. 0 keeps the triangles as they are.

    Returns:
        The scene, and a report with ``sizes`` (metres along x, y and z, by name of the object), ``degenerate`` (number
        of dropped triangles, by name of the object), ``warnings`` (sentences about possible mistakes), ``assumed``
        (sentences about what was assumed or taken from the file) and ``sheets`` (thickness in metres, by name of the
        object that was drawn with both faces and is now sheets).

    Raises:
        InputError: the file cannot be read, an object has no material, a material is unknown at the frequency, the unit
            or the up axis cannot be right, the objects are too far from the origin, or the scene has an invalid value.
        ParameterError: the frequency is not from 1 MHz to 1 THz, or an argument is of the wrong kind.

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
        >>> scene.objects[0].material, report.sizes, report.sheets, report.warnings
        ('concrete', {'yard': (4.0, 3.0, 0.0)}, {'yard': 0.1}, ())
    """
    hertz = read_frequency(frequency)
    require_path(path=path)
    require_word(METRES, unit=unit)
    require_word(get_args(Walls), walls=walls)
    if up is not None:
        require_word(("y", "z"), up=up)
    if default_material is not None:
        require_instance(str, default_material=default_material)
    require_instance(Gateway, gateway=gateway)
    require_instance(Transmitter, transmitter=transmitter)
    moved = check_array("shift", shift, (3,), "metres along x, y and z")
    if np.abs(moved).max() > LARGEST:
        raise ParameterError("shift", f"expected at most {LARGEST:g} m, found {shown(moved.tolist())}")
    if flatten is not None:
        require_within(0, 1, "metres", flatten=flatten)
    _check_materials(materials, own_materials)
    doing(f"{path}: reading the file")
    file = read_file(path)
    count = sum(len(part.mesh.faces) for part in file.parts)
    seconds = 20e-6 * count + 2e-3 * len(file.parts)
    doing(f"{path}: importing {count:,} triangles in {len(file.parts):,} objects", seconds)
    label = str(file.path)
    doubt = up_doubt(file, up, np.vstack([gateway.position, transmitter.corners()]), METRES[unit])
    if doubt is not None and doubt.decisive:
        raise InputError(f"{label}: {doubt.sentence}")
    gateway = replace(gateway, position=_moved(gateway.position, moved))
    low, high = (_moved(corner, moved) for corner in (transmitter.region_min, transmitter.region_max))
    transmitter = replace(transmitter, region_min=low, region_max=high)
    antennas = np.vstack([gateway.position, transmitter.corners()])
    axis = up or file.up
    objects, resolved, report = import_objects(
        file, materials, default_material, unit, axis, hertz, shift=moved, own_materials=own_materials
    )
    scene = Scene(plain_name(file.path.stem), hertz, gateway, transmitter, tuple(objects), resolved)
    # Before other checks: if the scene has the wrong place or size, they would blame the gateway.
    far = far_from_origin(scene.bounds, antennas, moved)
    if far is not None:
        raise InputError(f"{label}: {far}")
    size = unit_doubt(scene.bounds, antennas, unit, scene.wavelength)
    if size is not None and size.decisive:
        raise InputError(f"{label}: {size.sentence}")
    flat = None if flatten == 0 else flattened(scene, flatten)
    if flat is not None:
        scene = flat.scene
    validate(scene, label)  # as drawn, since the inside of a box is where no antenna can be
    found = drawn_walls(scene, walls)
    doubts = [each.sentence for each in (doubt, size) if each is not None]
    warnings = [f"{label}: {sentence}" for sentence in (*doubts, *antenna_warnings(scene), *found.warnings)]
    said = [_conventions(file, unit, up, moved), *([] if flat is None else [flat.sentence]), *found.assumed]
    assumed = [f"{label}: {sentence}" for sentence in said]
    report = replace(
        report,
        sizes={each.name: size_of(each.mesh) for each in found.scene.objects},
        warnings=(*report.warnings, *warnings),
        assumed=(*assumed, *report.assumed),
        sheets=found.sheets,
        flattened=None if flat is None else flat.shown,
    )
    doing("")
    return found.scene, report


def _moved(point: Vector3, shift: Float[np.ndarray, " 3"]) -> Vector3:
    """Shift an antenna. The sum is rounded to a micrometre, since map coordinates have no more digits."""
    if not shift.any():
        return point
    x, y, z = (round(float(coordinate + step), 6) for coordinate, step in zip(point, shift, strict=True))
    return x, y, z


def _conventions(file: ImportedFile, unit: str, up: str | None, shift: Float[np.ndarray, " 3"]) -> str:
    """Say with which axis, unit and shift the file was read."""
    kind = file.path.suffix[1:].upper()
    axis = f"up axis {up}" if up else f"up axis {file.up} (as usual for {kind})"
    moved = f", shifted by {' '.join(f'{each:.12g}' for each in shift)} m" if shift.any() else ""
    return f"read with {axis} and unit {unit}{moved}"


def _check_materials(rules: Any, own: Any) -> None:
    """Refuse rules, or materials of the user, of another kind."""
    pairs = 'expected pairs of a name and a material, such as [("Wall*", "concrete")]'
    if isinstance(rules, str) or not isinstance(rules, Sequence):
        raise ParameterError("materials", f"{pairs}, found {shown(rules)}")
    for rule in rules:
        if not (isinstance(rule, tuple | list) and len(rule) == 2 and all(isinstance(each, str) for each in rule)):
            raise ParameterError("materials", f"{pairs}, found {shown(rule)}")
    if own is None:
        return
    require_instance(Mapping, own_materials=own)
    for name, material in own.items():
        if not (isinstance(name, str) and isinstance(material, RadioMaterial)):
            found = f"found {shown(material)} for {shown(name)}"
            raise ParameterError("own_materials", f"expected a RadioMaterial for each name, {found}")
