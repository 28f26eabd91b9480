"""``bisplat`` as the tests of the pages run it: the command of the page, at a size that takes seconds.

``python tests/docs/small_size.py ARGUMENTS`` does what ``bisplat ARGUMENTS`` does, with fewer spectra, rays and steps,
the smallest models, and a page in the browser that closes once it is there.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

SPECTRA = 40
"""The largest number of spectra, positions or training spectra; the smallest with ten spectra to validate with."""

FITS = ("train", "compare", "evaluate", "plan", "demo")
"""Commands that fit covariances; only these import what they need for it."""

COARSE = {"max_depth": 1, "rays": 20_000, "diffraction": False}  # How rays are traced


def smaller(arguments: list[str]) -> list[str]:
    """The arguments of a command that does the same at a small size."""
    command, rest = arguments[0], list(arguments[1:])
    rooms = "--rooms" in rest
    limit_of = {
        "simulate": {"-n": 15 if rooms else SPECTRA, "--spectra": SPECTRA, "--patches": 50, "--rooms": 3},
        "crossvalidate": {"-n": 6, "--positions": 6},
        "plan": {"-n": 3, "--positions": 3},
        "calibrate": {"-n": 10, "--spectra": 10},
        "train": {"--steps": 2, "--budget": 0.01},
        "compare": {"--budget": 0.01, "--seeds": 2, "--tested": 5, "--steps": 2},
        "demo": {"-n": SPECTRA, "--spectra": SPECTRA, "--steps": 2},
    }.get(command, {})
    for option, limit in limit_of.items():
        if option in rest:
            at = rest.index(option) + 1
            rest[at] = str(min(type(limit)(rest[at]), limit))
    in_full_wave = "fullwave" in rest
    folder = bool(rest) and Path(rest[0]).is_dir()  # simulate a dataset again, or plan for a run: no rays to limit
    if command == "simulate" and not folder and not {"-n", "--spectra", "--positions", "--help"} & set(rest):
        rest += ["-n", str(SPECTRA)]
    traces = command == "calibrate" or (command in {"simulate", "plan"} and not folder and not rooms)
    if traces and "--help" not in rest:
        rest = [each for each in rest if each != "--diffraction"]
        if not in_full_wave:
            rest = [*_with(_with(rest, "--rays", "20000"), "--max-depth", "1"), "--no-diffraction"]
    if in_full_wave and "--field" not in rest and command == "simulate":
        rest = _with(rest, "--cell", "0.06")
    if command == "demo":
        rest = _with(_with(rest, "--steps", "2"), "-n", str(SPECTRA))
    if command == "train" and "--preset" in rest:  # its own number of steps is thousands
        rest = _with(rest, "--steps", "2")
    if "--ray" in rest:  # a cluster on this machine in place of the reader's
        at = rest.index("--ray")
        rest[at : at + 2] = ["--workers", "2"]
    if "--workers" in rest:
        rest[rest.index("--workers") + 1] = "2"
    if "--sizes" in rest:
        first = last = rest.index("--sizes") + 1
        while last < len(rest) and rest[last].isdigit():
            last += 1
        if any(int(size) > 20 for size in rest[first:last]):
            rest[first:last] = ["10", "20"][: last - first]
    return [command, *rest]


def _with(arguments: list[str], option: str, value: str) -> list[str]:
    """The arguments with an option set to a value."""
    if option in arguments:
        at = arguments.index(option)
        return [*arguments[: at + 1], value, *arguments[at + 2 :]]
    return [*arguments, option, value]


def use_small_sizes() -> None:
    """Make models small, training short, and ray tracing coarse, for commands and for ``import bisplat``."""
    from dataclasses import replace

    from learn.training import validation_part as epochs
    from learn.training.registry import MODELS

    small = {"primitives": 40, "clusters": 16, "ffn_width": 16, "ffn_layers": 1, "transformer_layers": 1,
             "transformer_ffn_width": 16}  # fmt: skip
    of = {"bisplat": small, "bisplat-plus": {**small, "primitives": 60}}
    of["bisplat-aperture"] = {"primitives": 40, "width": 16}
    for name, options in of.items():
        MODELS[name] = replace(MODELS[name], options=options)
    for name, model in MODELS.items():
        if model.by_steps is not None:
            MODELS[name] = replace(MODELS[name], by_steps=replace(model.by_steps, steps=2))
    epochs.STEPS_PER_VALIDATION = 2


def use_quick_fits() -> None:
    """Make fits of covariances end early."""
    from learn.models.kriging import stacking, vecchia

    vecchia.ITERATIONS, stacking.FOLDS = 15, 2


def trace_rooms_coarsely() -> None:
    """Make the rays of ``bisplat simulate --rooms``, which has no options for them, coarse."""
    from functools import partial

    from simulate.generation import simulated_rooms
    from simulate.rays.core.propagation import Propagation

    coarse: Any = Propagation(**COARSE)  # type: ignore[arg-type]
    simulated_rooms.simulate = partial(simulated_rooms.simulate, propagation=coarse)


def use_small_functions() -> None:
    """Make the functions of ``bisplat`` that take long do less."""
    import bisplat

    use_small_sizes()
    use_quick_fits()
    limits: dict[str, dict[str, Any]] = {
        "simulate": {"n": SPECTRA, "rays": 20_000},
        "crossvalidate": {"positions": 6},
        "compare": {"minutes": 0.01, "budget": 0.01, "seeds": 2},
        "calibrate": {"n": 10},
    }
    for name, limit in limits.items():
        setattr(bisplat, name, _limited(getattr(bisplat, name), limit))
    propagation = bisplat.Propagation
    bisplat.Propagation = lambda **options: propagation(**{**options, **COARSE})  # type: ignore


def _limited(function: Any, limits: dict[str, Any]) -> Any:
    def small(*arguments: Any, **options: Any) -> Any:
        kept = {key: min(value, limits[key]) if key in limits else value for key, value in options.items()}
        if function.__name__ == "simulate" and "engine" not in options and "propagation" not in options:
            import bisplat

            kept["propagation"] = bisplat.Propagation()
        return function(*arguments, **kept)

    return small


def close_when_served() -> None:
    """Load the page of ``bisplat view`` once, as a browser would, and then end the command as Ctrl-C does."""
    from scenes.browser import served_page

    serving = served_page.serving

    @contextmanager
    def for_a_moment(*arguments: Any) -> Iterator[str]:
        with serving(*arguments) as address:
            assert urllib.request.urlopen(address, timeout=60).status == 200
            threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
            yield address

    served_page.serving = for_a_moment


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    asks_for_help = len(sys.argv) < 2 or {"-h", "--help", "--version"} & set(sys.argv)
    # Training on several devices starts the program of this name once more for each.
    sys.argv[:] = [__file__, *(sys.argv[1:] if asks_for_help else smaller(sys.argv[1:]))]
    if not asks_for_help:
        use_small_sizes()
    if sys.argv[1:2] and sys.argv[1] in FITS and not asks_for_help:
        use_quick_fits()
    if "--rooms" in sys.argv:
        trace_rooms_coarsely()
    serves = sys.argv[1:2] == ["view"]
    if serves:
        close_when_served()
    from bisplat.__main__ import main

    try:
        main()
    except SystemExit as end:
        raise SystemExit(0 if serves and end.code == 130 else end.code) from None
