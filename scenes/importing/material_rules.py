"""Choose the material of each part of a file: by the user's rules, by the name in the file, or by a default."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from scenes.files.errors import InputError, listed, named
from scenes.importing.formats.mesh_part import ImportedFile, ImportedPart, material_at, proposed_rule, require_known
from scenes.importing.mitsuba_xml import SIONNA_DEFAULTS, MitsubaShape
from scenes.scene.materials import RadioMaterial

Rule = tuple[str, str]  # A name or pattern, and a material


@dataclass(frozen=True)
class Choice:
    material: RadioMaterial | None  # the material; None if there is none
    by: str  # what chose it, such as 'the rule "Wall*=concrete"'; or why there is none
    from_file: bool = False  # whether the file states the material, and the user gives no values for it


def matches(pattern: str, names: Iterable[str]) -> bool:
    """Whether a rule's left side is one of some names, literally or as a pattern with ``*``, ``?`` and ``[...]``."""
    return any(name == pattern or fnmatchcase(name, pattern) for name in names)


def deciding_rule(part: ImportedPart, stem: str, rules: Sequence[Rule]) -> Rule | None:
    """Return the rule that counts for a part: the first that matches one of its names, else the name of the file."""
    for names in (part.names(), (stem,)):
        for rule in rules:
            if matches(rule[0], names):
                return rule
    return None


def choose_materials(
    file: ImportedFile,
    rules: Sequence[Rule],
    default: str | None,
    frequency: float,
    own: Mapping[str, RadioMaterial],
) -> list[Choice]:
    """Choose each part's material: by a rule for it, by a rule for the file's name, by the file, or by default."""
    for material in (*(material for _, material in rules), *((default,) if default is not None else ())):
        try:
            require_known(material, own)
        except InputError as error:
            raise InputError(f"{file.path}: {error}") from None
    return [_choice(part, file.path.stem, rules, default, frequency, own) for part in file.parts]


def _choice(
    part: ImportedPart,
    stem: str,
    rules: Sequence[Rule],
    default: str | None,
    frequency: float,
    own: Mapping[str, RadioMaterial],
) -> Choice:
    try:
        rule = deciding_rule(part, stem, rules)
        if rule is not None:
            return Choice(material_at(rule[1], frequency, own), f"the rule {_shown(rule)}")
        if (stated := part.radio_material(frequency, own)) is not None:
            return Choice(stated, f'the file\'s "{part.material or stated.name}"', stated.name not in own)
        if default is not None:
            return Choice(material_at(default, frequency, own), "the default")
    except InputError as error:
        return Choice(None, str(error))
    return Choice(None, "")


def require_materials(file: ImportedFile, choices: Sequence[Choice]) -> list[RadioMaterial]:
    refused = next((choice.by for choice in choices if choice.material is None and choice.by), None)
    if refused is not None:
        raise InputError(refused if refused.startswith(str(file.path)) else f"{file.path}: {refused}")
    without = [part.name for part, choice in zip(file.parts, choices, strict=True) if choice.material is None]
    if without:
        raise InputError(
            f"{file.path}: expected a material for every object, found none for {listed(without)}; add a rule such as "
            f"--material {proposed_rule(without[0])}, or --default-material MATERIAL; --list shows all names"
        )
    return [choice.material for choice in choices if choice.material is not None]


def rule_warnings(file: ImportedFile, rules: Sequence[Rule]) -> list[str]:
    """Return a warning for each rule that matches nothing, or only what earlier rules have taken."""
    deciding = [deciding_rule(part, file.path.stem, rules) for part in file.parts]
    warnings = []
    for rule in rules:
        if rule in deciding:
            continue
        earlier = [
            _shown(other)
            for part, other in zip(file.parts, deciding, strict=True)
            if other is not None and matches(rule[0], [*part.names(), file.path.stem])
        ]
        if earlier:
            warnings.append(f"the material rule {_shown(rule)} never counts, since its objects go to {listed(earlier)}")
        else:
            objects = listed(part.name for part in file.parts)
            warnings.append(f"the material rule {_shown(rule)} matches no object; the objects are {objects}")
    return warnings


def _shown(rule: Rule) -> str:
    return named("=".join(rule))


def stated_materials(file: ImportedFile, choices: Sequence[Choice]) -> list[str]:
    """Say which materials were taken from the file, and which thickness was assumed for them."""
    taken: dict[str, list[str]] = {}
    for part, choice in zip(file.parts, choices, strict=True):
        if choice.from_file and choice.material is not None:
            taken.setdefault(choice.material.name, []).append(part.name)
    counted = [f"{name} ({listed(parts, 3)})" for name, parts in taken.items()]
    sentences = [f"took materials that the file names: {'; '.join(counted)}"] if taken else []
    usual = SIONNA_DEFAULTS["thickness"]
    assumed = [
        choice.material.name
        for part, choice in zip(file.parts, choices, strict=True)
        if choice.from_file and choice.material and isinstance(part, MitsubaShape) and not part.states_thickness
        if choice.material.thickness == usual
    ]
    if assumed:
        sentences.append(f"assumed a thickness of {usual:g} m, as Sionna RT does, for {listed(assumed)}")
    return sentences
