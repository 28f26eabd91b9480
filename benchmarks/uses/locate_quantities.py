"""How near are transmitters located from received powers and from channels?

python -m benchmarks.uses.locate_quantities --json > runs/locate_quantities.json

Test transmitters are located from the powers of six gateways in the office, and from the channels over 20 MHz of the
lab's uplink, both by rays. The numbers of known positions are those of the training part; as usual the validation part
is known, too. Errors are distances in metres. ``fingerprint`` copies the position of the known row whose powers are
nearest in dB, or whose channels are most correlated.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import tyro

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.smallest_room import smallest_room
from benchmarks.ledger.walks import channels_in_lab, powers_in_office
from learn.data.splits import SplitKind, split
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset

GATEWAYS = {"door": (0.5, 0.5, 1.5), "window": (1.0, 0.8, 1.2)}
"""Of the smallest room, metres."""

SIZES, SPLITS = (50, 200, 800), ("random", "blocked")


def rows_of(dataset: Dataset, kind: SplitKind, size: int) -> dict[str, Any]:
    """Errors of all methods for one split and one number of training positions."""
    from learn.localisation.locate import locate

    parts = split(dataset, kind, 0, size)
    rows = locate(replace(dataset, train=parts.known, test=parts.test)).rows()
    figures = {f"{row['method']}, {key}": row[key] for row in rows for key in ("median, m", "90 %, m")}
    return figures | {"within 90 % region": rows[0]["within 90 % region"]}


def small_datasets(folder: Path) -> dict[str, Dataset]:
    """Powers and channels of a few positions, made in seconds."""
    from simulate.exchange.csi_export import export_csi
    from simulate.generation.simulated_powers import simulate_rssi
    from simulate.generation.simulation import simulate
    from simulate.rays.core.propagation import Propagation

    room, sight = smallest_room(), Propagation(max_depth=0, diffraction=False)
    powers = simulate_rssi(room, folder / "powers", GATEWAYS, n=40, propagation=sight)
    simulate(room, folder / "wide", n=40, bandwidth=20e6, subcarriers=52, propagation=sight)
    export_csi(folder / "wide", folder / "channels")
    return {"powers": powers, "channels": read_dataset(folder / "channels")}


def main(
    folder: Path = Path("runs/walks"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Locate test transmitters from powers and from channels."""
    with tempfile.TemporaryDirectory() as temporary:
        if smallest:
            made = small_datasets(Path(temporary))
        else:
            made = {"powers": powers_in_office(folder / "powers"), "channels": channels_in_lab(folder / "channels")}
        figures = {
            f"{name}, {kind}, {size} known": rows_of(dataset, kind, size)  # type: ignore[arg-type]
            for name, dataset in made.items()
            for kind in SPLITS
            for size in ((15,) if smallest else SIZES)
        }
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
