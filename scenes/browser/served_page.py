"""A page that viser serves to this machine's browser until Ctrl-C."""

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
    """Serve a page until interrupted, and print its address; ``serving`` explains the arguments."""
    with serving(title, port, open_tab) as address:
        print(f"{address}  (Ctrl-C ends it)", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()


@contextlib.contextmanager
def serving(title: str, port: int, open_tab: Callable[[ClientHandle], Callable[[], None] | None]) -> Iterator[str]:
    """Serve a page within a block, which gets its address. The address has a token (``scenes.browser.access``).

    Args:
        title: of the page's panel.
        port: first to try; where it is taken, the next free one is used.
        open_tab: builds a browser tab, which has a state of its own; returns what to call when it is closed, if any.
            Its errors are shown in the tab.

    Raises:
        ParameterError: a port that this user may not open, or from which on all are taken.
    """
    free = _free_port(port)
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # a browser that goes away is no error
    warnings.filterwarnings("ignore", r"Queued a \w+ on a closed connection")  # viser: for a tab that is just closed
    token = secrets.token_urlsafe()
    with guard(token), contextlib.redirect_stdout(io.StringIO()):  # hides viser's own message with the address
        server = ViserServer(host=HOST, port=free, label=title, verbose=False)
    closing: dict[int, Callable[[], None]] = {}

    @server.on_client_connect
    def _(client: ClientHandle) -> None:
        close = shield(client, open_tab)(client)
        if close is not None:
            closing[client.client_id] = close
        if client.client_id not in server.get_clients():  # gone before it was built
            closing.pop(client.client_id, lambda: None)()

    @server.on_client_disconnect
    def _(client: ClientHandle) -> None:
        closing.pop(client.client_id, lambda: None)()

    if server.get_port() != port:
        say(f"port {port} is taken")
    try:
        yield f"http://{HOST}:{server.get_port()}/{token}"
    finally:
        for number in list(closing):
            closing.pop(number, lambda: None)()
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _free_port(first: int) -> int:
    """The first port from one on that is free; viser does not return where it finds none."""
    for port in range(first, 65536) if first > 0 else ():
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as viser's server: not if only just left
            try:
                probe.bind((HOST, port))
                return port
            except PermissionError:
                break
            except OSError:
                continue
    raise ParameterError("port", f"expected a port from 1 to 65535 that this user may open, found {first}")
