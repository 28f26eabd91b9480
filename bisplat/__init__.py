"""The Python interface of bisplat-wrf: ray-trace datasets of spectra, train models on them, and score the models.

>>> import bisplat
>>> scene = bisplat.load_scene("bedroom")
>>> coarse = bisplat.Propagation(max_depth=1, rays=20_000)
>>> dataset = bisplat.simulate(scene, "data/bedroom", n=20, seed=0, propagation=coarse)
>>> run = bisplat.train(dataset, "runs/bedroom", model="helmholtz", split="random")
>>> run.predict(dataset.positions[:3]).spectra.shape
(3, 90, 360)

The stub ``__init__.pyi`` lists the public names, for type checkers, for editors and for this module. A name is imported
when it is first used, so ``import bisplat`` loads neither torch nor the ray tracer.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from bisplat.own_packages import claim

claim()

_WITH_RAYS = {"Tracer", "calibrate"}
"""Names whose modules import the ray tracer. Without it they are not listed, so that help(bisplat) has all others."""


@cache
def _homes() -> dict[str, str]:
    """The module of each public name. It is read late, since every command imports this package."""
    import ast  # lazy-loader's attach_stub reads such stubs too, but only for modules inside the package
    from pathlib import Path

    stub = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    lines = [line for line in stub.body if isinstance(line, ast.ImportFrom) and line.module]
    return {each.name: str(line.module) for line in lines for each in line.names}


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return _listed()
    if name not in _homes():
        raise AttributeError(f"module 'bisplat' has no attribute {name!r}")
    # With a name in fromlist, a module such as shapes is imported too.
    value = getattr(__import__(_homes()[name], fromlist=[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *_listed()})


def _listed() -> list[str]:
    """The names that this installation can import."""
    from scenes.files.optional_packages import has_extra

    return sorted(_homes() if has_extra("rays") else _homes().keys() - _WITH_RAYS)
