"""``bisplat view``."""

from __future__ import annotations

import os
from typing import Annotated

from tyro.conf import Positional, arg


def view(what: Annotated[Positional[str], arg(metavar="RUN|DATASET|SCENE")], port: int = 8080) -> None:
    """Look at a run, a dataset or a scene in the browser: drag the transmitter, compare prediction and ray tracing.

    Args:
        what: run folder, NeRF² dataset folder, or scene (built-in name or YAML).
        port: port of the page, which only a browser on this machine can open; where it is taken, the next free one.
    """
    from learn.view.session import Session
    from learn.view.subject import subject
    from learn.view.tracing import Tracing
    from scenes.page import serve

    seen = subject(what)
    propagation, seed = seen.propagation
    tracing = None if seen.scene is None else Tracing(seen.scene, propagation, seen.region, seed)
    serve(f"bisplat: {seen.name}", port, lambda client: Session(client, seen, tracing).close)
    if tracing is not None:  # Dr.Jit aborts a process that exits normally while the tracing thread is tracing
        os._exit(0)
