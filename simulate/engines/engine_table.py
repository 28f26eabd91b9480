"""The table of engines, for the command line, metadata.json and cross-validation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scenes.files.errors import ParameterError, did_you_mean, shown
from simulate.engines.engine import Engine
from simulate.engines.fullwave_engine import FullWave
from simulate.engines.rays_engine import Rays

ENGINES: dict[str, type[Engine]] = {each.name: each for each in (Rays, FullWave)}


def engine_class(name: str) -> type[Engine]:
    if name not in ENGINES:
        raise ParameterError(
            "engine", f"expected the name of an engine, found {shown(name)}; {did_you_mean(name, ENGINES)}"
        )
    return ENGINES[name]


def engine_of(metadata: Mapping[str, Any]) -> Engine:
    """The engine that made a dataset; ``Rays()`` for a dataset that was not simulated."""
    return engine_class(metadata.get("engine", Rays.name)).of(metadata)
