"""How near are transmitters located from received powers and from channels?

python benchmarks/locate_quantities.py --json > runs/locate_quantities.json

Test transmitters are located from the powers of six gateways in the office, and from the channels over 20 MHz of the
lab's uplink, both by rays. The numbers of known positions are those of the training part; as usual the validation part
is known, too. Errors are distances in metres. ``fingerprint`` copies the position of the known row whose powers are
nearest in dB, or whose channels are most correlated; trilateration by the log-distance law is for powers alone.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from ledger.printing import print_figures
from ledger.smallest_room import smallest_room

from learn.data.splits import SplitKind, split
from scenes.scene.description import Scene
from simulate.csi.csi_dataset import CsiDataset, read_csi
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi

if TYPE_CHECKING:
    from simulate.rays.core.propagation import Propagation

GATEWAYS = {
    "north-west": (0.4, 9.6, 2.4),
    "north-east": (15.6, 9.6, 2.4),
    "south-west": (0.4, 0.4, 2.4),
    "south-east": (15.6, 0.4, 2.4),
    "middle": (8.0, 4.0, 2.3),
    "desk": (11.0, 3.0, 1.1),
}
"""In the office, metres."""

SIZES, POSITIONS, SPLITS = (50, 200, 800), 1500, ("random", "blocked")


def rows_of(dataset: RssiDataset | CsiDataset, kind: SplitKind, size: int) -> dict[str, Any]:
    """Errors of all methods for one split and one number of training positions."""
    from learn.localisation.judged_places import by_channels, by_powers, error_rows
    from learn.localisation.locate_channels import locate_channels
    from learn.localisation.locate_powers import locate_powers

    parts = split(dataset, kind, 0, size)
    assert dataset.positions is not None
    if isinstance(dataset, RssiDataset):
        heard = dataset.rssi_dbm[parts.test]
        places = locate_powers(dataset, heard, known=parts.known, level=0.0)
        simpler = by_powers(dataset, parts.known, heard, 0)
    else:
        heard = dataset.uplink[parts.test]
        places = locate_channels(dataset, heard, known=parts.known)
        simpler = by_channels(dataset, parts.known, heard, 0)
    rows = error_rows(places, dataset.positions[parts.test], simpler)
    figures = {f"{row['method']}, {key}": row[key] for row in rows for key in ("median, m", "90 %, m")}
    return figures | {"within 90 % region": rows[0]["within 90 % region"]}


def datasets(
    folder: Path, office: Scene | str, lab: Scene | str, count: int, propagation: Propagation
) -> dict[str, RssiDataset | CsiDataset]:
    """The powers and the channels, simulated unless the folder has them."""
    from simulate.engines.rays_engine import Rays
    from simulate.exchange.csi_export import export_csi
    from simulate.generation.simulation import simulate
    from simulate.rssi.rssi_simulation import simulate_rssi

    powers, wide, channels = (folder / name for name in ("powers", "wide", "channels"))
    if not powers.exists():
        simulate_rssi(office, powers, GATEWAYS, n=count, propagation=propagation)
    if not channels.exists():
        simulate(lab, wide, n=count, bandwidth=20e6, subcarriers=52, engine=Rays(propagation))
        export_csi(wide, channels)
    return {"powers": read_rssi(powers), "channels": read_csi(channels)}


def main(
    folder: Path = Path("runs/locate_quantities"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Locate test transmitters from powers and from channels.

    Args:
        folder: keeps the simulated datasets for the next call.
        smallest: only test the benchmark, in seconds; its figures mean nothing.
        json_output: print one JSON object.
    """
    from simulate.rays.core.propagation import Propagation

    with tempfile.TemporaryDirectory() as temporary:
        if smallest:
            room = smallest_room()
            made = datasets(Path(temporary), room, room, 40, Propagation(max_depth=0, diffraction=False))
        else:
            made = datasets(folder, "office", "lab", POSITIONS, Propagation())
        figures = {
            f"{name}, {kind}, {size} known": rows_of(dataset, kind, size)  # type: ignore[arg-type]
            for name, dataset in made.items()
            for kind in SPLITS
            for size in ((15,) if smallest else SIZES)
        }
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
