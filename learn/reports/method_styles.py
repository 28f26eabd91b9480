"""One colour, dash and marker for each method, the same in every figure, whatever else is drawn and in which order."""

from __future__ import annotations

import re
import zlib
from collections import Counter
from collections.abc import Iterable
from itertools import product
from typing import Any

from learn.quantities.array_ceiling import CEILING

CEILING_STYLE: dict[str, Any] = {"color": "0.35", "lw": 1.2, "ls": "--"}
"""Line of the array's ceiling, the same in every figure, since it is a bound and not a method. No method is grey."""

SOLID, DASHED, DOTTED, DASH_DOT, LONG = "-", (0, (4, 1.5)), (0, (1, 1.2)), (0, (4, 1.2, 1, 1.2)), (0, (8, 2))
SPARSE, DASH_DOT_DOT, SHORT = (0, (1, 1.8)), (0, (3, 1, 1, 1, 1, 1)), (0, (2, 1))
_DASHES = (SOLID, DASHED, DOTTED, DASH_DOT, LONG, SPARSE, DASH_DOT_DOT, SHORT)

KNOWN: dict[str, tuple[str, Any, str]] = {
    "helmholtz": ("#1f4e9e", SOLID, "o"),
    "bisplat": ("#d62728", SOLID, "s"),
    "bisplat-plus": ("#ff7f0e", DASHED, "D"),
    "bisplat-aperture": ("#a6195f", DASH_DOT, "^"),
    "twin": ("#17807e", LONG, "v"),
    "mirror-images": ("#ef6fa8", DASH_DOT_DOT, "H"),
    "mlp": ("#7b4fa3", DASHED, "P"),
    "mlp-responses": ("#b58ad8", SOLID, "X"),
    "nerf2": ("#2ca02c", DASH_DOT, "<"),
    "swiftwrf": ("#84b819", LONG, ">"),
    "wrf-gs-plus": ("#00614a", SHORT, "*"),
    "gsrf": ("#5b8a00", DOTTED, "8"),
    "mean-picture": ("#9a7d00", SPARSE, "d"),
    "nearest": ("#1fa5c9", DASH_DOT_DOT, "p"),
    "inverse-distance": ("#8c564b", SHORT, "h"),
}
"""Colour, dash and marker of the methods of this package."""

ALSO_CALLED = {"mean": "mean-picture"}  # Other names of methods, those in rooms and for powers

_COLOURS = ("#e377c2", "#393b79", "#637939", "#8c6d31", "#843c39", "#00b3a4", "#f0a30a", "#5254a3")
_OTHERS = [
    (colour, dash, marker)
    for dash, (marker, colour) in product((SOLID, DASHED, DOTTED, DASH_DOT), zip("osDv^<>P", _COLOURS, strict=True))
]

THIS_RUN, DOUBTFUL = " (this run)", " †"
"""What follows a method's name in tables and figures: it is the run that the page is about; its scores are doubtful."""

REDUCED = " (reduced)"  # What follows it where the model has a smaller size than the published one, for want of a GPU


def method_name(label: str) -> str:
    """The name of a method without what tables and figures add to it."""
    return re.sub(r", \d+$", "", label.removesuffix(DOUBTFUL)).removesuffix(THIS_RUN).removesuffix(REDUCED)


def line_styles(labels: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Properties of the lines of methods: colour, dash, width, and marker for lines with points."""
    found: dict[str, dict[str, Any]] = {}
    taken: set[int] = set()
    sizes: Counter[str] = Counter()
    for label in sorted(set(labels), key=lambda each: (method_name(each), each)):
        name = ALSO_CALLED.get(method_name(label), method_name(label))
        if name == CEILING:
            found[label] = CEILING_STYLE
            continue
        if name in KNOWN:
            colour, dash, marker = KNOWN[name]
        else:
            number = zlib.crc32(name.encode()) % len(_OTHERS)
            free = (each % len(_OTHERS) for each in range(number, number + len(_OTHERS)))
            number = next((each for each in free if each not in taken), number)
            taken.add(number)
            colour, dash, marker = _OTHERS[number]
        if sizes[name]:  # the same method, with another number of known spectra
            dash = _DASHES[(_DASHES.index(dash) + sizes[name]) % len(_DASHES)]
        sizes[name] += 1
        width = 1.8 if label.removesuffix(DOUBTFUL).endswith(THIS_RUN) else 1.1
        found[label] = {"color": colour, "ls": dash, "lw": width, "marker": marker}
    return found
