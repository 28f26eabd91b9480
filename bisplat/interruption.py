"""Ctrl-C ends a command with one sentence, at whatever moment it comes."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

SENTENCE = "bisplat: interrupted; run the same command again to continue"

STATUS = 130
"""Exit status of an interrupted command, as of shells."""


def heed_interrupts() -> None:
    """Let Ctrl-C raise KeyboardInterrupt, or end the process at once where that exception would be lost.

    While a module is imported, or in a callback of a library in C, the exception would be printed and forgotten, or
    would abort the process. Nothing is lost if the process ends there, since a killed command can be continued. A
    second Ctrl-C also ends it at once. If SIGINT is ignored, as in the background jobs of a shell, it stays ignored.
    """
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        return
    pressed = False

    def on_interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        if pressed or _is_importing(frame):
            leave()
        pressed = True
        raise KeyboardInterrupt

    before = sys.unraisablehook

    def on_unraisable(lost: sys.UnraisableHookArgs) -> None:
        if issubclass(lost.exc_type, KeyboardInterrupt):
            leave()
        before(lost)

    signal.signal(signal.SIGINT, on_interrupt)
    sys.unraisablehook = on_unraisable


def leave() -> None:
    """End the process at once, with the sentence."""
    cursor = "\x1b[?25h" if os.isatty(2) else ""  # a progress bar hides it
    try:
        os.write(2, f"{cursor}{SENTENCE}\n".encode())
    finally:
        os._exit(STATUS)


def _is_importing(frame: FrameType | None) -> bool:
    """Whether an import is under way in a frame or in one that called it."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False
