"""The files of ``bisplat compare`` for a folder of rooms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from learn.comparison.doubts import doubts_of, footnote_of
from learn.reports.provenance import Provenance
from learn.reports.sweep_figure import draw_sweep, over_seeds
from learn.reports.table_files import write_scores
from learn.rooms.room_comparison import RoomComparison


def write_room_comparison(comparison: RoomComparison, folder: Path) -> None:
    """Write results.json, table.tex, table.csv, and rooms.png (and .pdf): mean SSIM over the number known."""
    averages = comparison.averages()
    made = _provenance(comparison)
    write_scores(comparison, folder, made)
    axes = ("known spectra in a test room", f"mean SSIM\n{over_seeds(averages).strip()}")
    figure = folder / "rooms.png"
    draw_sweep(averages, "ssim_mean", axes, figure, made, doubts_of(averages), footnote_of(averages))


def _provenance(comparison: RoomComparison) -> Provenance:
    name = comparison.folder.resolve().name
    seeds = max(row["seed"] for row in comparison) + 1
    spectra = next(row["spectra"] for row in comparison)
    return Provenance(
        title=f"Comparison of methods in the rooms of {name}",
        model=", ".join(dict.fromkeys(row["label"] for row in comparison)),
        dataset=name,
        split=f"setting {comparison.setting}",
        spectra=f"{_rooms(comparison.training, 'training')}, {_rooms(comparison.test, 'test')}, {spectra} test spectra",
        distances="the known spectra of a test room are drawn at random",
        seed="0" if seeds == 1 else f"0 to {seeds - 1}",
    )


def _rooms(names: Sequence[str], kind: str) -> str:
    return f"1 {kind} room" if len(names) == 1 else f"{len(names)} {kind} rooms"
