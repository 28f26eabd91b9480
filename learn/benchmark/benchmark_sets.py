"""The named benchmark datasets, as data: what each contains and which tasks it has. A set never changes once frozen.

A benchmark is a task of a set, such as rssi-office-blocked-200: which rows are known and which are predicted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal, NamedTuple

Kind = Literal["spectra", "powers", "channels"]

SEED = 0
"""Seed of everything that is drawn: positions, rays, noise, and the parts of the tasks."""

STRIDE = 4
"""One in so many positions of a simulated path, 8 mm apart, is in a set: every 3.2 cm, a tenth of λ at 915 MHz."""


@dataclass(frozen=True)
class BenchmarkSet:
    """A dataset from a built-in place, with its tasks."""

    about: str  # what it is, in a line
    kind: Kind  # quantity to predict
    scene: str  # name of the built-in scene
    count: int  # number of positions, ``STRIDE`` steps apart on a simulated path
    known: tuple[int, ...] = ()  # numbers of known positions, a task for each; empty: all that are not tested
    # position of each gateway of received powers, metres, world frame, by its name
    gateways: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)  # further options of ``simulate`` or ``simulate_rssi``
    # carrier frequency ("frequency") and array ("rows", "columns") instead of the scene's
    changes: Mapping[str, Any] = field(default_factory=dict)

    @property
    def frequencies(self) -> tuple[float, ...]:
        """The frequencies of each position, Hz; empty: that of the scene."""
        return self.options.get("frequencies", ())

    @property
    def tasks(self) -> dict[str, Task]:
        """The tasks by their names, which follow that of the set."""
        sizes: Sequence[int | None] = self.known or (None,)
        tasks = [Task(split, size) for split in ("random", "blocked") for size in sizes]
        return {"-".join(str(part) for part in each if part is not None): each for each in tasks}


class Task(NamedTuple):
    """Which rows are known and which are predicted."""

    split: Literal["random", "blocked"]  # how the tested positions are chosen, as in ``split``
    known: int | None  # number of known positions; None: all that are not tested


SETS: dict[str, BenchmarkSet] = {
    "rssi-office": BenchmarkSet(
        "powers (RSSI) at six gateways in the office, 915 MHz, 2,200 positions",
        kind="powers",
        scene="office",
        count=2200,
        known=(50, 200, 1000),
        gateways={
            "north-west": (0.4, 9.6, 2.4),
            "north-east": (15.6, 9.6, 2.4),
            "south-west": (0.4, 0.4, 2.4),
            "south-east": (15.6, 0.4, 2.4),
            "middle": (8.0, 4.0, 2.3),
            "desk": (11.0, 3.0, 1.1),
        },
    ),
    "csi-lab": BenchmarkSet(
        "channels of 8 antennas and 26 + 26 subcarriers over 20 MHz in the lab, 2.4 GHz, SNR 25 dB, 1,400 positions",
        kind="channels",
        scene="lab",
        count=1400,
        known=(50, 200, 400, 1000),
        options={"bandwidth": 20e6, "subcarriers": 52, "measurement": {"snr_db": 25.0}},
        changes={"frequency": 2.4e9, "rows": 1, "columns": 8},
    ),
    "lab": BenchmarkSet(
        "spectra of 4 × 4 elements in the lab, 915 MHz, 800 positions of the transmitter",
        kind="spectra",
        scene="lab",
        count=800,
    ),
    "closet": BenchmarkSet(
        "spectra of 4 × 4 elements in the closet, 915 MHz, 500 positions of the transmitter",
        kind="spectra",
        scene="closet",
        count=500,
    ),
    "moving-receiver-bedroom": BenchmarkSet(
        "spectra in the bedroom, where the array moves and the transmitter stands, 915 MHz, 600 positions",
        kind="spectra",
        scene="bedroom",
        count=600,
        known=(25, 100, 400),
        options={"moving": "receiver"},
    ),
    "ten-frequencies-closet": BenchmarkSet(
        "spectra at ten frequencies from 902 to 928 MHz in the closet, 150 positions of the transmitter",
        kind="spectra",
        scene="closet",
        count=150,
        options={"frequencies": tuple(902e6 + 26e6 * number / 9 for number in range(10))},
    ),
    "practice": BenchmarkSet(
        "a few spectra in the closet, made in seconds: to try out the commands",
        kind="spectra",
        scene="closet",
        count=60,
        options={"propagation": {"max_depth": 1, "diffraction": False, "rays": 20_000}},
    ),
}
"""The sets by name."""


class Benchmark(NamedTuple):
    """A task of a set."""

    of: str  # name of the set
    task: str  # name of its task


@cache
def benchmarks() -> dict[str, Benchmark]:
    """Every benchmark by its name.

    >>> benchmarks()["rssi-office-blocked-200"]
    Benchmark(of='rssi-office', task='blocked-200')
    """
    return {f"{name}-{task}": Benchmark(name, task) for name, each in SETS.items() for task in each.tasks}
