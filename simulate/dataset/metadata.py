"""The schema of metadata.json, and the one function that reads it. docs/format.md states the ranges."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from scenes.files.errors import InputError
from scenes.files.input_file import beside
from scenes.files.json_file import read_json
from scenes.files.schema import conform
from scenes.scene.description import HIGHEST_FREQUENCY, LOWEST_FREQUENCY, MOST_ELEMENTS, MOST_IN_A_ROW, WIDEST_SPACING

Count = Annotated[int, Meta(ge=0)]
Side = Annotated[int, Meta(ge=1, le=MOST_IN_A_ROW)]
Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]
Step = Annotated[float, Meta(gt=0, le=360)]


class Array(Struct, frozen=True, forbid_unknown_fields=True):
    """Fields of ``PlanarArray``; the spacing in wavelengths."""

    rows: Side = 4
    columns: Side = 4
    spacing: Annotated[float, Meta(gt=0, le=WIDEST_SPACING)] = 0.5


class Grid(Struct, frozen=True, forbid_unknown_fields=True):
    """Fields of ``AngularGrid``, degrees."""

    elevation_first_deg: Annotated[float, Meta(ge=-360, le=360)] = 0.0
    elevation_step_deg: Step = 1.0
    azimuth_step_deg: Step = 1.0


class Mechanisms(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Fields of ``Propagation``, and the seed of the rays."""

    max_depth: Count = 0
    los: bool = True
    specular: bool = True
    refraction: bool = True
    diffuse: bool = True
    patches: Annotated[int, Meta(ge=1)] = 1
    diffraction: bool = True
    slab_phase: bool = True
    sionna: bool = True
    rays: Annotated[int, Meta(ge=1)] = 1
    seed: Count = 0


class Receiver(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Fields of ``Measurement``, and the seed of the errors."""

    seed: Count
    snr_db: float | None = None
    gain_error_db: NotNegative = 0.0
    phase_error_deg: NotNegative = 0.0
    phase_noise_deg: NotNegative = 0.0


class Solver(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Fields of ``FullWave``, and what follows from them."""

    cell: Positive
    solver: str
    window_ns: Positive = 1.0
    antennas: str = ""


class Metadata(Struct, kw_only=True):
    """metadata.json. Any key may be missing and others may be there, since other programs write the file, too."""

    made_by: str = ""
    scene: str = ""
    scene_file: str = ""
    scene_sha256: str = ""
    frequency_hz: Annotated[float, Meta(ge=LOWEST_FREQUENCY, le=HIGHEST_FREQUENCY)] = LOWEST_FREQUENCY
    array: Array = Array()
    grid: Grid = Grid()
    spectra: Count = 0
    placement: str = ""
    positions_sha256: str = ""
    engine: Literal["rays", "fullwave"] = "rays"
    propagation: Mechanisms = Mechanisms()
    method: str = ""
    fullwave: Solver | None = None
    measurement: Receiver | None = None
    power: bool = False
    seed: Count = 0
    picture: str = ""
    versions: dict[str, str] = {}


class Simulated(Metadata, kw_only=True):
    """metadata.json of a folder that ``bisplat simulate`` made, as it has to be to make the folder again."""

    scene_file: str
    scene_sha256: str
    placement: str
    positions_sha256: str
    measurement: Receiver
    power: bool
    seed: Count


class FullWaveSimulated(Simulated, kw_only=True):
    """The same, of a folder that was simulated in full wave."""

    fullwave: Solver


def read_metadata_file(path: Path, expected: str, simulated: bool = False) -> dict[str, Any]:
    """Read metadata.json and check every field.

    Args:
        path: the file.
        expected: what should be there, for the message.
        simulated: it has to have what ``bisplat simulate`` writes; else only what is there is checked.

    Returns:
        Its content.

    Raises:
        InputError: the file cannot be read, is no JSON, or has a field of another type or out of its range.
    """
    content = read_json(path, expected)
    fullwave = isinstance(content, dict) and content.get("engine") == "fullwave"
    schema = FullWaveSimulated if fullwave else Simulated if simulated else Metadata
    checked = conform(content, schema, str(path))
    elements = checked.array.rows * checked.array.columns
    if elements > MOST_ELEMENTS:
        raise InputError(f"{path}: array: expected at most {MOST_ELEMENTS} elements, found {elements}")
    try:
        beside(path, checked.scene_file)
    except InputError as error:
        raise InputError(f"{path}: scene_file: {error}") from None
    return content
