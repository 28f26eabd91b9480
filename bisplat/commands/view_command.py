"""The command ``bisplat view``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from scenes.files.optional_packages import require_extra
from simulate.dataset.dataset_kinds import quantity_of


def view(
    what: Annotated[Positional[str], arg(metavar="RUN|DATASET|SCENE")],
    port: int = 8080,
    positions: Path | None = None,
) -> None:
    """Explore a run, a dataset or a scene in the browser.

    The transmitter can be moved with the mouse. The page compares predicted with ray-traced spectra. Of received powers
    (RSSI) it shows the coverage map of each gateway, and of responses over a band the power over delay.

    Args:
        what: run folder, dataset folder (spectra, RSSI or CSI), or scene (a built-in name or a scene YAML).
        port: port of the page, for browsers on this machine. If it is taken, the next free port.
        positions: CSV file of further positions to show, such as bisplat plan writes.
    """
    require_extra("viewer", "the viewer")
    from scenes.browser.served_page import serve
    from simulate.positions.positions import read_points

    planned = None if positions is None else read_points(positions)
    if quantity_of(Path(what)) == "power":
        from learn.view.power_subject import PowerSubject
        from learn.view.power_tab import PowerTab

        powers = PowerSubject.of(Path(what))
        powers.planned = planned
        serve(f"bisplat: {powers.name}", port, lambda client: PowerTab(client, powers).close)
        return
    if quantity_of(Path(what)) == "channel":
        from learn.view.channel_tab import ChannelTab, require_places_and_band
        from simulate.dataset.dataset_folder import read_dataset

        channels = read_dataset(what)
        require_places_and_band(channels)
        serve(
            f"bisplat: {channels.folder.resolve().name}",
            port,
            lambda client: ChannelTab(client, channels, planned).close,
        )
        return
    from learn.view.session import Session, Tracing
    from learn.view.subject import subject

    shown = subject(what)
    shown.planned = planned
    propagation, seed = shown.propagation
    tracing = None
    if shown.scene is not None and not shown.array_moves:
        tracing = Tracing(shown.scene, shown.beamformer, propagation, shown.region, seed)
    serve(f"bisplat: {shown.name}", port, lambda client: Session(client, shown, tracing).close)
    if tracing is not None:  # Dr.Jit aborts a process that exits normally while the tracing thread is tracing
        os._exit(0)
