"""What a message proposes can be followed: each call is refused or warned of, and the proposal then works."""

from __future__ import annotations

import re
import shlex
import shutil
import tomllib
from pathlib import Path

import pytest

from scenes.files.optional_packages import EXTRAS
from scenes.scene.shapes import box

pytestmark = pytest.mark.usefixtures("small_models", "no_ceiling")

PLACE = "--gateway 0.5 0.5 1 --boresight 1 0 0 --region-min 1 0.2 0.5 --region-max 2 0.8 0.9"

NAMED = r'did you mean "(.+?)"'
REPLACED = r"(--force) replaces"

ADVICE: dict[str, tuple[str, str]] = {
    "train tiny -o out --model mlpp --steps 1": (NAMED, "train tiny -o out --model {} --steps 1 --batch-size 17"),
    "scene wall.obj -o out": (
        r"needs (--output, )?--gateway, --boresight",
        f"scene wall.obj -o out {PLACE} --unit m --default-material wood",
    ),
    "scene wall.obj": (r"; (--list) alone shows", "scene wall.obj {}"),
    f"scene wall.obj -o out {PLACE}": (r"or (--default-material) MATERIAL", f"scene wall.obj -o out {PLACE} {{}} wood"),
    f"scene odd.obj -o out {PLACE}": (r"(--material .*?)=MATERIAL", f"scene odd.obj -o out {PLACE} {{}}=wood'"),
    f"scene wall.obj -o out {PLACE} --default-material mud": (
        r"(--own-material mud)=PERMITTIVITY,CONDUCTIVITY,THICKNESS",
        f"scene wall.obj -o out {PLACE} --default-material mud {{}}=15,1,0.3",
    ),
    f"scene wall.obj -o out {PLACE} --default-material wood --frequency 2.4": (
        r"2\.4 GHz are (\S+)",
        f"scene wall.obj -o out {PLACE} --default-material wood --frequency {{}}",
    ),
    f"scene mm.obj -o out {PLACE} --default-material wood": (
        r"with the unit (\w+) it would be",
        f"scene mm.obj -o out {PLACE} --default-material wood --unit {{}}",
    ),
    "simulate 'my room.obj' -o out": (
        r"import it with bisplat (scene .*?) -o FOLDER",
        f"{{}} -o out {PLACE} --default-material wood",
    ),
    "scene closet -o there.png": (REPLACED, "scene closet -o there.png {}"),
    "check leaking": (r"use the (split blocked)", "train leaking -o out --{} --model mlp --steps 1"),
    "train unlisted -o out": (r"use the (split random)", "train unlisted -o out --{} --model mlp --steps 1"),
}
"""Of each call: a pattern of what its message proposes, and the call that follows it, with what the group matched."""


@pytest.fixture(scope="module")
def place(tmp_path_factory, write_folder) -> Path:
    """A folder of meshes, and of folders of pictures as other programs write them."""
    folder = tmp_path_factory.mktemp("place")
    write_folder(folder / "tiny")
    write_folder(folder / "leaking", count=60)
    write_folder(folder / "unlisted", count=12)
    for part in ("train", "test"):
        (folder / "unlisted" / f"{part}_index.txt").unlink()
    wall = box((-1, 2, 0), (4, 2.2, 2.4))
    wall.export(folder / "wall.obj")
    shutil.copy(folder / "wall.obj", folder / "my room.obj")
    text = (folder / "wall.obj").read_text()
    (folder / "odd.obj").write_text(re.sub(r"(?m)^(o .*|g .*)?$", "", text).replace("v ", "o a [1] = b's\nv ", 1))
    wall.apply_scale(1000).export(folder / "mm.obj")
    (folder / "there.png").write_text("precious")
    return folder


@pytest.mark.parametrize("call", ADVICE)
def test_proposal_works(call, command, place, monkeypatch):
    monkeypatch.chdir(place)
    monkeypatch.setattr("scenes.browser.served_page.serve", lambda title, port, open_tab: None)
    monkeypatch.setattr("scenes.drawing.scene_drawing.draw_scene", lambda scene, path: path.write_bytes(b""))
    pattern, following = ADVICE[call]
    before = set(place.rglob("*"))
    status, out, err = command(*shlex.split(call))
    said = " ".join((out + err).split())
    proposal = re.search(pattern, said)
    assert proposal is not None and status in (0, 1), said
    status, _, err = command(*shlex.split(following.format(proposal[1])))
    assert status == 0, err
    for path in sorted(set(place.rglob("*")) - before, reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()


def test_packages_to_install_are_those_of_the_project():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert set(EXTRAS) <= set(project["optional-dependencies"]) and project["name"] == "bisplat-wrf"
