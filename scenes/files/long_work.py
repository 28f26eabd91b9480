"""Tell what a command is doing where that takes long, so that nothing works in silence."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from scenes.files.plain_text import say

SHORT = 0.5  # Seconds; what should take less is not told, even on a busy machine

AFTER = 2.0  # Seconds of silence after which it is told

_now = ""  # What is being done; empty while nothing takes long, or a progress bar tells

_last, _when = "", 0.0  # What was told last, and when


def doing(sentence: str, seconds: float | None = None) -> None:
    """Name what begins now, how much it is, and how long it may take if that is known; an empty text for the end."""
    global _now
    _now = sentence if seconds is None else f"{sentence}{about(seconds)}" if seconds > SHORT else ""


def tell(sentence: str, apart: float = 0.0) -> None:
    """Say what is being done, unless that was told last, or anything less than some seconds ago."""
    global _last, _when
    if sentence != _last and time.monotonic() - _when >= apart:
        _last, _when = sentence, time.monotonic()
        say(sentence)


@contextmanager
def told() -> Iterator[None]:
    """Say within a block what ``doing`` named, when nothing of this kind was said for ``AFTER`` seconds."""
    global _when
    _when = time.monotonic()
    ended = threading.Event()

    def watch() -> None:
        before = ""
        while not ended.wait(AFTER / 8):
            if _now and _now == before:  # not what takes a moment
                tell(_now, AFTER)
            before = _now

    threading.Thread(target=watch, daemon=True).start()
    try:
        yield
    finally:
        ended.set()
        doing("")


def about(seconds: float, left: str = "") -> str:
    """How long something may take, for the end of a sentence; nothing if that is short."""
    if seconds < AFTER:
        return ""
    return f", about {seconds:.0f} s{left}" if seconds < 100 else f", about {seconds / 60:.0f} minutes{left}"
