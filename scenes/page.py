"""A page that viser serves to this machine's browser until Ctrl-C."""

from __future__ import annotations

import contextlib
import io
import logging
import socket
import sys
import threading
from collections.abc import Callable

from viser import ClientHandle, ViserServer

from scenes.errors import ParameterError

HOST = "127.0.0.1"


def serve(title: str, port: int, open_tab: Callable[[ClientHandle], Callable[[], None] | None]) -> None:
    """Serve a page until interrupted, and print its address; takes the next free port where this one is taken.

    Args:
        title: of the page's panel.
        port: first to try.
        open_tab: builds a browser tab, which has a state of its own; returns what to call when it is closed, if any.

    Raises:
        ParameterError: a port that this user may not open.
    """
    if not 0 < port < 65536 or not _allowed(port):
        raise ParameterError("port", f"expected a port from 1 to 65535 that this user may open, found {port}")
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # a browser that goes away is no error
    with contextlib.redirect_stdout(io.StringIO()):  # hides viser's own message with the address
        server = ViserServer(host=HOST, port=port, label=title, verbose=False)
    closing: dict[int, Callable[[], None]] = {}

    @server.on_client_connect
    def _(client: ClientHandle) -> None:
        close = open_tab(client)
        if close is not None:
            closing[client.client_id] = close
        if client.client_id not in server.get_clients():  # gone before it was built
            closing.pop(client.client_id, lambda: None)()

    @server.on_client_disconnect
    def _(client: ClientHandle) -> None:
        closing.pop(client.client_id, lambda: None)()

    if server.get_port() != port:
        print(f"bisplat: port {port} is taken", file=sys.stderr)
    print(f"http://{HOST}:{server.get_port()}  (Ctrl-C ends it)", flush=True)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        pass
    finally:
        for close in list(closing.values()):
            close()
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _allowed(port: int) -> bool:
    with socket.socket() as probe:
        try:
            probe.bind((HOST, port))
        except PermissionError:
            return False
        except OSError:
            return True  # taken: viser tries the next
    return True
