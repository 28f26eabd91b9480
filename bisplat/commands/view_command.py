"""The command ``bisplat view``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from scenes.files.extras import require_extra


def view(
    what: Annotated[Positional[str], arg(metavar="RUN|DATASET|SCENE")],
    port: int = 8080,
    positions: Path | None = None,
) -> None:
    """Explore a run, a dataset or a scene in the browser.

    The transmitter can be moved with the mouse. The page compares predicted with ray-traced spectra.

    Args:
        what: run folder, dataset folder, or scene (a built-in name or a scene YAML).
        port: port of the page, for browsers on this machine. If it is taken, the next free port.
        positions: CSV file of further positions to show, such as bisplat plan writes.
    """
    require_extra("viewer", "the viewer")
    from learn.view.session import Session
    from learn.view.subject import subject
    from learn.view.tracing import Tracing
    from scenes.browser.served_page import serve
    from simulate.positions.given_positions import read_points

    shown = subject(what)
    if positions is not None:
        shown.planned = read_points(positions)
    propagation, seed = shown.propagation
    tracing = None if shown.scene is None else Tracing(shown.scene, shown.beamformer, propagation, shown.region, seed)
    serve(f"bisplat: {shown.name}", port, lambda client: Session(client, shown, tracing).close)
    if tracing is not None:  # Dr.Jit aborts a process that exits normally while the tracing thread is tracing
        os._exit(0)
