"""Serve a page with viser to a browser on this machine, until Ctrl-C."""

from __future__ import annotations

import contextlib
import io
import logging
import secrets
import socket
import threading
import warnings
from collections.abc import Callable, Iterator

from viser import ClientHandle, ViserServer

from scenes.browser.access import guard
from scenes.browser.callbacks import shield
from scenes.files.errors import ParameterError
from scenes.files.plain_text import say

HOST = "127.0.0.1"


def serve(title: str, port: int, open_tab: Callable[[ClientHandle], Callable[[], None] | None]) -> None:
    """Print the address of a page and serve it until Ctrl-C. ``serving`` explains the arguments."""
    with serving(title, port, open_tab) as address:
        print(f"{address}  (Ctrl-C ends it)", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()


@contextlib.contextmanager
def serving(title: str, port: int, open_tab: Callable[[ClientHandle], Callable[[], None] | None]) -> Iterator[str]:
    """Serve a page within a block."""
    free = _free_port(port)
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # a browser that disconnects is not an error
    warnings.filterwarnings("ignore", r"Queued a \w+ on a closed connection")  # viser, for a tab that has just closed
    token = secrets.token_urlsafe()
    with guard(token), contextlib.redirect_stdout(io.StringIO()):  # hides viser's own message with the address
        server = ViserServer(host=HOST, port=free, label=title, verbose=False)
    closing: dict[int, Callable[[], None]] = {}

    @server.on_client_connect
    def _(client: ClientHandle) -> None:
        close = shield(client, open_tab)(client)
        if close is not None:
            closing[client.client_id] = close
        if client.client_id not in server.get_clients():  # the tab was closed while it was being built
            closing.pop(client.client_id, lambda: None)()

    @server.on_client_disconnect
    def _(client: ClientHandle) -> None:
        closing.pop(client.client_id, lambda: None)()

    if server.get_port() != port:
        say(f"port {port} is taken; the page is at port {server.get_port()}")
    try:
        yield f"http://{HOST}:{server.get_port()}/{token}"
    finally:
        for number in list(closing):
            closing.pop(number, lambda: None)()
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _free_port(first: int) -> int:
    """Return the first free port from a number on. viser itself would never return if there is none."""
    for port in range(first, 65536) if first > 0 else ():
        with socket.socket() as probe:
            probe.setsockopt(
                socket.SOL_SOCKET, socket.SO_REUSEADDR, 1
            )  # as viser's server, so that a port that was just closed is free
            try:
                probe.bind((HOST, port))
                return port
            except PermissionError:
                break
            except OSError:
                continue
    raise ParameterError("port", f"expected a port from 1 to 65535 that this user may open, found {first}")
