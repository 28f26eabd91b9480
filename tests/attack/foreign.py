"""Hypothesis strategies: changes to the folder of another program's pictures, as that program may have written it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from PIL import Image

Draw = Callable[[st.SearchStrategy], Any]
Change = Callable[[Path], object]

MODES = ("L", "LA", "P", "coloured P", "1", "RGB", "RGBA", "10 bit", "12 bit", "16 bit", "8 bit in 16", "I", "CMYK")

SIZES = ((360, 90), (361, 91), (361, 90), (90, 360), (180, 45), (720, 180), (360, 180), (2, 2), (1, 1))

LEVELS = (
    *("as they are", "power", "decibels", "one level", "one pixel", "two levels"),
    *("rolled", "mirrored", "upside down"),
)


def stored(levels: np.ndarray, mode: str) -> Image.Image:
    """A picture of levels 0…1 in a mode."""
    grey = Image.fromarray(np.round(255 * levels).astype(np.uint8))
    if mode in ("P", "coloured P"):
        indexed = Image.fromarray(np.asarray(grey), "P")
        ramp = range(256)
        indexed.putpalette([value for n in ramp for value in ((n, n, n) if mode == "P" else (n, 255 - n, 7 * n % 256))])
        return indexed
    most = {"10 bit": 1023, "12 bit": 4095, "16 bit": 65535, "8 bit in 16": 255}.get(mode)
    if most is not None:
        return Image.fromarray(np.round(most * levels).astype(np.uint16))
    return Image.fromarray(np.round(70_000 * levels).astype(np.int32)) if mode == "I" else grey.convert(mode)


def changed(levels: np.ndarray, how: str) -> np.ndarray:
    """Levels 0…1 that mean something else."""
    if how == "power":
        return levels**2
    if how == "decibels":
        return (np.clip(20 * np.log10(np.maximum(levels, 1e-9)), -60, 0) + 60) / 60
    if how == "one level":
        return np.full_like(levels, 0.5)
    if how == "one pixel":
        return np.eye(*levels.shape) * (np.arange(levels.shape[1]) == 3)
    if how == "two levels":
        return (levels > 0.5).astype(float)
    turned = {"rolled": np.roll(levels, 180, axis=1), "mirrored": levels[:, ::-1], "upside down": levels[::-1]}
    return turned.get(how, levels)


@st.composite
def pictures(draw: Draw) -> Change:
    """Pictures in another mode, of another size or meaning, or under other names."""
    mode, size, how = draw(st.sampled_from(MODES)), draw(st.sampled_from(SIZES)), draw(st.sampled_from(LEVELS))
    size = size if draw(st.booleans()) else (360, 90)
    rename = draw(st.sampled_from(("{:05d}.png", "{:05d}.PNG", "{}.png", "{:05d}.tif", "{:05d}.jpg", "x{}.png")))
    first, some = draw(st.sampled_from((1, 1, 0, 7))), draw(st.booleans())

    def change(here: Path) -> None:
        folder = here / "measured" / "spectrum"
        files = sorted(folder.iterdir())
        for number, path in enumerate(files[: 3 if some else len(files)]):
            levels = np.asarray(Image.open(path).convert("L")) / 255
            path.unlink()
            made = stored(changed(levels, how), mode).resize(size, Image.Resampling.NEAREST)
            target = folder / rename.format(number + first)
            if target.suffix == ".jpg":
                made.convert("L").save(target, format="jpeg")
            else:
                made.save(target, format="tiff" if target.suffix == ".tif" or mode in ("I", "CMYK") else "png")

    return change


KEYS: dict[str, tuple[Any, ...]] = {
    "frequency_hz": (915, 2.4, 2.4e9, "915 MHz", 0, -1, 1e300, None, float("nan"), [915e6], True),
    "array": (
        {"rows": 4, "columns": 4, "spacing": 0.5},
        {"rows": 1, "columns": 16, "spacing": 0.5},
        *({"rows": 0}, 16, {}),
    ),
    "grid": ({"elevation_first_deg": 0}, {"elevation_first_deg": 89, "elevation_step_deg": -1}, {}, "1 degree"),
    "made_by": ("bisplat-wrf 0.2.0", "bisplat convert", "NeRF2", "", 3),
    "scene": ("closet", 3),
    "scene_file": ("scene/scene.yaml", "/etc/passwd", "../data/scene/scene.yaml", 3),
    "engine": ("rays", "fullwave", "x", None),
    "spectra": (8, 7, -1, "8"),
    "seed": (0, -1, 2**70),
    "quantity": ("power", "decibels", 1),
    "comment": ("by hand", {"a": []}),
}


FREQUENCIES = ("0.915\n", "2.4\n2.5\n", "915e6\n", "nan\n", "", "2.4 GHz\n", "x" * 5000)
"""Contents of freq.txt."""


@st.composite
def metadata(draw: Draw) -> Change:
    """A metadata.json of one to three keys, as somebody writes it by hand, or a freq.txt."""
    names = draw(st.lists(st.sampled_from(sorted(KEYS)), min_size=1, max_size=3, unique=True))
    content = {name: draw(st.sampled_from(KEYS[name])) for name in names}
    frequencies = draw(st.sampled_from((None, *FREQUENCIES)))

    def change(here: Path) -> None:
        (here / "measured" / "metadata.json").write_text(json.dumps(content))
        if frequencies is not None:
            (here / "measured" / "freq.txt").write_text(frequencies)

    return change


PARTS = (
    *("metadata.json", "gateway_info.yml", "tx_pos.csv", "train_index.txt", "test_index.txt", "channels.npz"),
    *("field.npz", "spectrum", "scene", "config.json", "split.json", "weights.safetensors", "training.json"),
    *("protocol.json", "results.jsonl", "per_sample", "checkpoints"),
)
"""Files and folders of datasets, runs and comparisons that another one of them may hold too."""


@st.composite
def swapped(draw: Draw, folders: tuple[str, ...], donors: tuple[str, ...]) -> Change:
    """One or two parts of a folder in place of those of another one: each is valid, but they do not belong together."""
    folder, donor = draw(st.sampled_from(folders)), draw(st.sampled_from(donors))
    parts = draw(st.lists(st.sampled_from(PARTS), min_size=1, max_size=2, unique=True))
    whole = draw(st.integers(0, 4)) == 0

    def change(here: Path) -> None:
        everything = [path.name for path in (here / donor).iterdir()] if (here / donor).exists() else []
        for name in everything if whole else parts:
            source, target = here / donor / name, here / folder / name
            if not source.exists() or not (here / folder).exists() or folder == donor:
                continue
            if target.is_dir():
                shutil.rmtree(target)
            (shutil.copytree if source.is_dir() else shutil.copy)(source, target)

    return change
