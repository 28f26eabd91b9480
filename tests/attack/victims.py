"""What is attacked: valid files, the command that reads each, and the ways to change each."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_material
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from scenes.storage.scene_writing import write_scene
from simulate.dataset.written_dataset import write_dataset
from simulate.positions.positions import write_positions
from tests import corpus
from tests import hostile_files as hostile
from tests.attack import changes

Ways = tuple[Callable[[bytes], st.SearchStrategy[bytes]], ...]

BYTES: Ways = (changes.damaged,)
TEXT: Ways = (changes.damaged, changes.reworded, changes.reworded)
JSON: Ways = (*TEXT, changes.json_of, changes.json_of)
YAML: Ways = (*TEXT, changes.yaml_of, changes.yaml_of)
NPZ: Ways = (changes.damaged, changes.npz_of, changes.npz_of)
TENSORS: Ways = (changes.damaged, changes.safetensors_of, changes.safetensors_of)

PLACE = "--gateway 0.5 0.5 1 --boresight 1 0 0 --region-min 1 0.2 0.5 --region-max 2 0.8 0.9 --default-material wood"


@dataclass(frozen=True)
class Victim:
    """A file, and a command that reads it."""

    file: str  # its path in the workplace
    command: str  # arguments of ``bisplat``; the workplace is the current folder
    ways: Ways  # strategies that make another content from the valid one
    needs: tuple[str, ...]  # files and folders of the workplace that the command takes
    output: tuple[str, ...] = ("out",)  # files and folders that the command may write
    then: str | None = None  # another command that reads the file, where the first one took it; None: there is none

    def contents(self, whole: Path) -> st.SearchStrategy[Callable[[Path], object]]:
        """Strategy: a function that makes the changed file at a path."""
        valid = (whole / self.file).read_bytes()
        changed = st.one_of([way(valid) for way in self.ways]).map(corpus.content)
        special = st.sampled_from([make for make, _ in corpus.ANY_FILE.values()])
        return st.integers(0, 9).flatmap(lambda number: changed if number else special)


def victims_of(folder: str, files: Iterable[tuple[str, Ways]], command: str, **others) -> tuple[Victim, ...]:
    needs = others.pop("needs", (folder,))
    return tuple(Victim(f"{folder}/{file}", command, ways, needs, **others) for file, ways in files)


DATASETS = (
    *victims_of(
        "data",
        [
            ("metadata.json", JSON),
            ("gateway_info.yml", YAML),
            ("tx_pos.csv", TEXT),
            ("train_index.txt", TEXT),
            ("channels.npz", NPZ),
            ("spectrum/00003.png", BYTES),
        ],
        "check data",
        output=(),
    ),
    *victims_of("measured", [("gateway_info.yml", YAML), ("spectrum/00003.png", BYTES)], "check measured", output=()),
)

FOREIGN = victims_of(
    "measured",
    [("gateway_info.yml", YAML), ("tx_pos.csv", TEXT), ("test_index.txt", TEXT), ("spectrum/00002.png", BYTES)],
    "dataset measured -o out",
    then="check out",
)

POWERS = (
    *victims_of(
        "powers",
        [
            ("gateway_rssi.csv", TEXT),
            ("gateway_position.yml", YAML),
            ("tx_pos.csv", TEXT),
            ("train_index.txt", TEXT),
            ("metadata.json", JSON),
        ],
        "check powers",
        output=("out.h5",),
        then="export powers --hdf5 out.h5",
    ),
    *victims_of(
        "powers",
        [("gateway_rssi.csv", TEXT), ("gateway_position.yml", YAML), ("tx_pos.csv", TEXT)],
        "compare powers -o out --split random --methods inverse-distance log-distance helmholtz",
    ),
    Victim(
        "gateways.yml",
        "simulate room/scene.yaml -o out --gateways gateways.yml -n 3 --max-depth 0",
        YAML,
        ("room", "gateways.yml"),
        then="check out",
    ),
)

RECORDED = "--frequency 2.4GHz --array 2x2@0.5 --gateway 0 0 1 --boresight 1 0 0"

RECORDINGS = tuple(
    victim
    for name, ways in {"log.npz": NPZ, "log.csv": TEXT}.items()
    for victim in victims_of(
        "recordings", [(name, ways)], f"dataset recordings/{name} -o out {RECORDED}", then="check out"
    )
)

RUNS = (
    *victims_of(
        "network",
        [("config.json", JSON), ("split.json", JSON), ("training.json", JSON), ("weights.safetensors", TENSORS)],
        "predict network --positions places.csv -o out.npz",
        needs=("data", "network", "places.csv"),
        output=("out.npz",),
    ),
    *victims_of(
        "kriged",
        [("config.json", JSON), ("weights.safetensors", TENSORS)],
        "predict kriged --positions places.csv -o out.npz",
        needs=("data", "kriged", "places.csv"),
        output=("out.npz",),
    ),
    Victim(
        "places.csv",
        "predict kriged --positions places.csv -o out.npz",
        TEXT,
        ("data", "kriged", "places.csv"),
        ("out.npz",),
    ),
)

RESUMED = (
    *victims_of(
        "begun",
        [("config.json", JSON), ("split.json", JSON), ("checkpoints/last.ckpt", BYTES)],
        "train data -o begun --model mlp-responses --steps 4 --batch-size 2",
        needs=("data", "begun"),
        output=("begun",),
    ),
    *victims_of(
        "compared",
        [("protocol.json", JSON), ("results.jsonl", TEXT), ("per_sample/nearest-0.npz", BYTES)],
        "compare data -o compared --models nearest inverse-distance",
        needs=("data", "compared"),
        output=("compared",),
    ),
    *victims_of(
        "scored",
        [("protocol.json", JSON), ("results.jsonl", TEXT), ("per_sample/mean-0.npz", BYTES)],
        "compare powers -o scored --split random --methods mean nearest",
        needs=("powers", "scored"),
        output=("scored",),
    ),
)

SCENES = (
    *victims_of(
        "room",
        [("scene.yaml", YAML), ("meshes/wall.ply", BYTES)],
        "scene room/scene.yaml -o out.png",
        output=("out.png", "traced"),
        then="simulate room/scene.yaml -n 2 -o traced --max-depth 2 --rays 1000",
    ),
    *victims_of("xml", [("room.xml", TEXT), ("wall.obj", TEXT)], f"scene xml/room.xml -o out {PLACE}"),
)

MESHES = tuple(
    victim
    for name, ways in {
        "wall.ply": BYTES,
        "text.ply": TEXT,
        "wall.stl": BYTES,
        "wall.obj": TEXT,
        "wall.off": TEXT,
        "wall.gltf": JSON,
        "wall.glb": BYTES,
        "parts.obj": TEXT,
        "solids.stl": TEXT,
        "instances.gltf": JSON,
    }.items()
    for victim in victims_of("meshes", [(name, ways)], f"scene meshes/{name} -o out {PLACE}")
)

FIELDS = victims_of(
    "field",
    [("metadata.json", JSON), ("field.npz", NPZ)],
    "simulate closet -n 3 -o out --engine fullwave --field field",
)

GROUPS = {
    "datasets": DATASETS,
    "foreign folders": FOREIGN,
    "recordings": RECORDINGS,
    "received powers": POWERS,
    "runs": RUNS,
    "runs and comparisons begun": RESUMED,
    "scenes": SCENES,
    "meshes": MESHES,
    "full-wave fields": FIELDS,
}
"""Each group gets as many attacks as any other."""


def small_room() -> Scene:
    """Floor and a wall: drawn at once."""
    concrete = p2040_material("concrete", 915e6)
    return Scene(
        name="room",
        frequency=915e6,
        gateway=Gateway((0.3, 1.5, 1.4), facing((1, 0, 0))),
        transmitter=Transmitter((1.2, 0.8, 0.9), (2.6, 2.2, 1.6)),
        objects=(
            SceneObject("floor", sheet((0, 0, 0), (3, 0, 0), (0, 3, 0)), "concrete"),
            SceneObject("wall", sheet((0, 3, 0), (3, 0, 0), (0, 0, 2.4)), "concrete"),
        ),
        materials={"concrete": concrete},
    )


def write_recordings(folder: Path) -> None:
    """Positions and responses of 2 × 2 elements."""
    folder.mkdir()
    generator = np.random.default_rng(0)
    places = generator.uniform((2, -1, 0), (4, 1, 2), (12, 3))
    parts = generator.normal(size=(2, 12, 4))
    values = parts[0] + 1j * parts[1]
    np.savez(folder / "log.npz", pos=places, H=values)
    names = ",".join(["x,y,z", *(f"h{number}_re,h{number}_im" for number in range(4))])
    columns = np.column_stack([places, np.stack([values.real, values.imag], axis=-1).reshape(12, 8)])
    np.savetxt(folder / "log.csv", columns, delimiter=",", header=names, comments="")


def write_powers(folder: Path) -> None:
    """A folder of received powers, and gateways to simulate some."""
    generator = np.random.default_rng(0)
    powers = generator.uniform(-90, -40, (12, 2))
    powers[3, 1] = np.nan
    gateways = {"door": (0.0, 0.0, 2.0), "7": (5.0, 0.0, 2.0)}
    write_dataset(
        folder / "powers",
        generator.uniform((2, -1, 0), (4, 1, 2), (12, 3)),
        powers=powers,
        gateways=gateways,
        frequency=2.4e9,
    )
    (folder / "gateways.yml").write_text(
        "door: [0.3, 0.5, 2.0]\nroof: {position: [1, 1, 2], boresight: [1, 0, 0], pattern: dipole}\n"
    )


def make_files(folder: Path, field: Path) -> None:
    """Write the valid files that need no command of ours."""
    corners = np.array(hostile.CORNERS)
    write_positions(folder / "places.csv", np.array([[1.5, 1.0, 1.2], [1.7, 1.1, 1.0]]))
    write_recordings(folder / "recordings")
    write_powers(folder)
    write_scene(small_room(), folder / "room")
    (folder / "xml").mkdir()
    mesh = '<string name="filename" value="wall.obj"/><bsdf type="diffuse" id="mat-itu_wood"/>'
    turned = hostile.to_world('<rotate x="1" angle="90"/><translate value="0, 2, 0"/>')
    (folder / "xml" / "room.xml").write_text(
        hostile.xml(hostile.rectangle(turned), f'<shape type="obj" id="board">{mesh}</shape>')
    )
    (folder / "xml" / "wall.obj").write_bytes(hostile.obj())
    (folder / "meshes").mkdir()
    for name, content in {
        "wall.ply": hostile.ply(corners),
        "text.ply": hostile.ply(corners.tolist(), binary=False),
        "wall.stl": hostile.stl(),
        "wall.obj": hostile.obj(),
        "wall.off": hostile.off(),
        "wall.gltf": hostile.gltf_bytes(),
        "wall.glb": hostile.glb(hostile.gltf_bytes()),
        "parts.obj": hostile.parts_obj(),
        "solids.stl": hostile.solids_stl(),
        "instances.gltf": hostile.gltf_bytes(nodes=[hostile.INSTANCES], extensionsRequired=["EXT_mesh_gpu_instancing"]),
    }.items():
        (folder / "meshes" / name).write_bytes(content)
    shutil.copytree(field, folder / "field")
