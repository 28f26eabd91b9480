"""What all rows of an experiment have in common, as protocol.json records it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Int
from msgspec import Meta, Struct

from learn.data.splits import GUARD_MOST, SplitKind
from scenes.files.json_yaml_xml import read_json
from scenes.files.schema import conform
from simulate.spectra.spectrum import evenly

PROTOCOL = "protocol.json"
"""Name of the file with the settings of an experiment."""

SPLIT_SEED = 0
"""Seed of the split, the same for every method and for every seed of a method."""


@dataclass(frozen=True)
class Settings:
    """Settings that all rows of an experiment have in common. The file protocol.json records them."""

    dataset: str  # absolute path of the dataset's folder
    split: SplitKind  # how the test part is chosen
    split_seed: int  # seed of the split
    # training time of each model that is trained by steps. None: there is no limit, and ``steps`` is set.
    minutes: float | None
    steps: int | None  # number of training steps of each such model. None: as many as fit into ``minutes``.
    device: str  # name of the GPU, or number of CPU threads, on which methods are trained
    # largest number of test spectra, evenly spread over the test part. None: all of them.
    test_spectra: int | None = None
    # fingerprint of the dataset. None: version 0.2 began the experiment and kept none.
    dataset_sha256: str | None = None
    # known positions nearer than this to a test position are left out, wavelengths. None: all are known.
    guard: float | None = None
    # digest of the index files of the split "files". None: another split, or version 0.2 kept none.
    index_sha256: str | None = None

    def tested(self, test: Int[np.ndarray, " n"]) -> Int[np.ndarray, " K"]:
        """The spectra of the test part on which every method is scored."""
        return test if self.test_spectra is None else evenly(test, self.test_spectra)


class Protocol(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The content of protocol.json: the fields of ``Settings`` that are not None."""

    dataset: str
    split: SplitKind
    split_seed: Annotated[int, Meta(ge=0)]
    minutes: Annotated[float, Meta(gt=0)] | None = None
    steps: Annotated[int, Meta(ge=1)] | None = None
    device: str
    test_spectra: Annotated[int, Meta(ge=1)] | None = None
    dataset_sha256: str | None = None
    guard: Annotated[float, Meta(gt=0, le=GUARD_MOST)] | None = None
    index_sha256: str | None = None


def read_protocol(path: Path) -> dict[str, Any]:
    """The settings in a protocol.json."""
    content = read_json(path, "the settings of an experiment")
    conform(content, Protocol, str(path))
    return content


def in_common(settings: dict[str, Any]) -> dict[str, Any]:
    """The settings that all calls of a comparison must share.

    The fingerprint of the data is left out, which is compared by itself, since old experiments have none. So is the
    device where the number of steps is given, since it only decides how long they take.

    >>> in_common({"dataset": "lab", "steps": 9, "device": "2 CPU threads", "dataset_sha256": "0f"})
    {'dataset': 'lab', 'steps': 9}
    """
    fixed_steps = settings.get("steps") is not None
    return {
        key: value
        for key, value in settings.items()
        if not key.endswith("_sha256") and not (key == "device" and fixed_steps)
    }
