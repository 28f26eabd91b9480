"""The command ``bisplat view``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from scenes.files.optional_packages import require_extra


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
    from learn.view.subject import subject
    from learn.view.tab import Tab
    from learn.view.tracing import Tracing
    from scenes.browser.served_page import serve
    from simulate.positions.positions import read_points

    shown = subject(what)
    shown.planned = None if positions is None else read_points(positions)
    tracing = None
    if shown.traced is not None:
        propagation, seed = shown.propagation
        tracing = Tracing(shown.traced, shown.beamformer, propagation, shown.region, seed)
    serve(f"bisplat: {shown.name}", port, lambda client: Tab(client, shown, tracing).close)
    if tracing is not None:  # Dr.Jit aborts a process that exits normally while the tracing thread is tracing
        os._exit(0)
