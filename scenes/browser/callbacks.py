"""Callbacks of a page that show their errors to the user. viser only prints a traceback, and the panel freezes."""

from __future__ import annotations

import contextlib
import functools
import inspect
import logging
from collections.abc import Callable, Iterator
from typing import Any

from viser import ClientHandle

from scenes.files.errors import InputError, printable


def shield(client: ClientHandle, callback: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a callback so that it shows its errors as notifications and keeps working."""
    if inspect.iscoroutinefunction(callback):

        @functools.wraps(callback)
        async def shielded_coroutine(*arguments: Any) -> Any:
            with _shown_errors(client):
                return await callback(*arguments)

        return shielded_coroutine

    @functools.wraps(callback)
    def shielded_function(*arguments: Any) -> Any:
        with _shown_errors(client):
            return callback(*arguments)

    return shielded_function


@contextlib.contextmanager
def _shown_errors(client: ClientHandle) -> Iterator[None]:
    try:
        yield
    except Exception as error:  # the tab must show any error
        if not isinstance(error, InputError | OSError):
            logging.getLogger("bisplat").exception("an error in a browser tab")
        name = "" if isinstance(error, InputError | OSError) else f"{type(error).__name__}: "
        client.add_notification("Error", printable(f"{name}{error}"), color="red")
