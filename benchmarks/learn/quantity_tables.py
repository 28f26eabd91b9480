"""How well are powers, channels and the spectra of a moving receiver predicted along a walk?

python -m benchmarks.learn.quantity_tables --of powers --json > runs/powers-office.json

Methods that are fitted without steps are compared for several numbers of known positions, split random and blocked.
The table has the score that ranks methods; with ``--scores`` it has all of them, and seconds of fit and predictions.
Fits are kept in runs/walks.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.smallest_room import smallest_room
from benchmarks.ledger.walks import channels_in_lab, powers_in_office, receiver_in_bedroom, with_known

OF_SPECTRA = "mean-picture", "nearest", "inverse-distance", "kriging", "kriging-responses", "helmholtz"
"""Methods for spectra. None is trained by steps."""

KNOWN = {"powers": (50, 200, 1000), "channels": (50, 200, 400, 1000), "receiver": (25, 100, 400)}

SCORES: dict[str, dict[str, tuple[str, str]]] = {
    "powers": {
        "error_median_db": ("median error (dB)", ".2f"),
        "error_p90_db": ("90th percentile (dB)", ".2f"),
        "coverage_90": ("in 90 % interval", ".3f"),
        "seconds": ("seconds", ".1f"),
    },
    "channels": {
        "snr_median_db": ("median SNR (dB)", ".1f"),
        "snr_p10_db": ("10th percentile (dB)", ".1f"),
        "correlation_median": ("correlation", ".4f"),
        "delay_spread_error_median_ns": ("delay spread off (ns)", ".1f"),
        "coverage_90": ("in 90 % interval", ".3f"),
        "seconds": ("seconds", ".1f"),
    },
    "receiver": {
        "ssim_median": ("median SSIM", ".3f"),
        "ssim_p05": ("5th percentile", ".3f"),
        "psnr_mean": ("PSNR (dB)", ".1f"),
        "aoa_error_median_deg": ("error of the strongest direction (°)", ".1f"),
        "seconds": ("seconds", ".1f"),
    },
}
"""Scores with heading and format, by their key in a row; the first one ranks."""


def compared(of: str, dataset: Any, output: Path) -> list[dict[str, Any]]:
    """The scores of all methods on the dataset's own parts, the best first."""
    from learn.comparison.compare import compare

    rows = compare(dataset, OF_SPECTRA if of == "receiver" else None, output=output).table()
    return [row for row in rows if of != "receiver" or row["label"] in OF_SPECTRA]


def main(
    of: Literal["powers", "channels", "receiver"] = "powers",
    scores: bool = False,
    folder: Path = Path("runs/walks"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Make a dataset, and compare the methods on it."""
    from simulate.generation.simulated_powers import simulate_rssi
    from simulate.rays.core.propagation import Propagation

    make: dict[str, Callable[[Path], Any]]
    make = {"powers": powers_in_office, "channels": channels_in_lab, "receiver": receiver_in_bedroom}
    with tempfile.TemporaryDirectory() as temporary:
        sizes = KNOWN[of]
        if smallest:
            of, folder, sizes = "powers", Path(temporary), (10,)
            sight = Propagation(max_depth=0, diffraction=False)
            place = {"door": (0.5, 0.5, 1.5)}
            dataset = simulate_rssi(smallest_room(), folder / of, place, n=40, propagation=sight)
        else:
            dataset = make[of](folder / of)
        figures: dict[str, dict[str, str]] = {}
        first = next(iter(SCORES[of]))
        for kind in ("random", "blocked"):
            for known in sizes:
                task = f"{kind}-{known}"
                for row in compared(of, with_known(dataset, kind, known), folder / f"{of}-{task}"):
                    told = {key: each for key, each in SCORES[of].items() if row.get(key) is not None}
                    cells = {heading: format(row[key], shape) for key, (heading, shape) in told.items()}
                    if scores and cells:
                        figures[f"{task}, {row['label']}"] = cells
                    elif first in told:
                        figures.setdefault(row["label"], {})[task] = cells[SCORES[of][first][0]]
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
