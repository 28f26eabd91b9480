"""Hypothesis strategies: what stands in the way of an output, and links at names that a program may use meanwhile."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

Draw = Callable[[st.SearchStrategy], Any]
Change = Callable[[Path], object]

OUTPUTS: dict[str, str] = {
    "simulate closet -n 3 --engine fullwave --field field": "out",
    "train data --model mlp-responses --steps 2 --batch-size 2": "out",
    "predict network --positions places.csv": "out.npz",
    "export data --hdf5": "out.h5",
    "export network": "out.pt2",
    "dataset measured": "out",
    "dataset recordings/log.npz --frequency 2.4GHz --array 2x2@0.5": "out",
    "simulate room/scene.yaml --gateways gateways.yml -n 3 --max-depth 0": "out",
    "compare data --models nearest": "out",
    "scene room/scene.yaml": "out.png",
    "plan kriged -n 2": "out.csv",
    "scene meshes/wall.obj": "out",
}
"""Commands by the outputs that they make."""

NAMES = (
    *(".{}.unfinished", "{}.unfinished", ".{}.tmp", "{}.tmp", "{}.part", "{}.partial", "{}.bak", "{}~", ".{}.lock"),
    *("{}/.bisplat-lock", "{}/metadata.json.tmp", "{}/config.json.tmp", "{}/scene.tmp", "{}/parts", "{}/spectrum"),
    *("{}/protocol.json.tmp", "{}/field", "{}/checkpoints", "{}/logs", "{}/meshes", "{}/channels.npz.partial.npz"),
)
"""Names that somebody may foresee, beside an output and in it."""

WAYS: dict[str, Callable[[Path, Path], object]] = {
    "a link to a file": lambda path, precious: path.symlink_to(precious / "file"),
    "a link to a folder": lambda path, precious: path.symlink_to(precious),
    "a link to nothing": lambda path, precious: path.symlink_to(precious / "nothing"),
    "a hard link": lambda path, precious: os.link(precious / "file", path),
    "a link to itself": lambda path, precious: path.symlink_to(path.name),
    "a file": lambda path, precious: path.write_text("precious"),
    "a folder": lambda path, precious: path.mkdir(),
    "a full folder": lambda path, precious: (path.mkdir(), (path / "file").write_text("precious")),
    "a pipe": lambda path, precious: os.mkfifo(path),
    "a device": lambda path, precious: path.symlink_to("/dev/full"),
}


def _precious(here: Path) -> Path:
    """A folder of which nothing may be lost."""
    folder = here / "precious"
    folder.mkdir(exist_ok=True)
    (folder / "file").write_text("precious")
    (folder / "spectrum").mkdir(exist_ok=True)
    (folder / "spectrum" / "00001.png").write_text("precious")
    return folder


@st.composite
def links(draw: Draw, output: str) -> Change:
    """One to three things at names that a command may use for what is unfinished."""
    # An output with a suffix is a file, in which nothing can be planted.
    names = [name for name in NAMES if "/" not in name] if "." in output else NAMES
    planted = [
        (draw(st.sampled_from(names)).format(output), draw(st.sampled_from(sorted(WAYS))))
        for _ in range(draw(st.integers(1, 3)))
    ]

    def change(here: Path) -> None:
        precious = _precious(here)
        for name, way in planted:
            path = here / name
            path.parent.mkdir(exist_ok=True)
            if not os.path.lexists(path):
                WAYS[way](path, precious)

    return change


@st.composite
def in_the_way(draw: Draw, output: str) -> tuple[str, Change]:
    """Where an output shall be, and what is there already, or is in place of its folder."""
    way = draw(st.sampled_from(sorted(WAYS)))
    parent = draw(st.sampled_from(("", "", "", "in/", "places.csv/", "nothing/there/")))
    long = draw(st.sampled_from(("", "", "", "", "x" * 300)))
    name = f"{parent}{long}{output}"

    def change(here: Path) -> None:
        precious = _precious(here)
        (here / "in").mkdir()
        path = here / name
        if not long and path.parent.is_dir():
            WAYS[way](path, precious)

    return name, change
