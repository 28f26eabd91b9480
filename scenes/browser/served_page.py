"""Serve a page with viser to browsers on this machine, until Ctrl-C: access, and errors in callbacks.

Any website that the user visits can send requests to 127.0.0.1, and can give this address a name of its own (DNS
rebinding). The headers Host and Origin reveal such requests. The token in the address also keeps out programs of other
users on this machine.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import io
import logging
import secrets
import socket
import threading
import warnings
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from http import HTTPStatus
from importlib.metadata import version
from typing import Any

import websockets.asyncio.server
from viser import ClientHandle, ViserServer
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from scenes.files.errors import InputError, ParameterError, printable
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
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # a port that was just closed is free
            try:
                probe.bind((HOST, port))
                return port
            except PermissionError:
                break
            except OSError:
                continue
    raise ParameterError("port", f"expected a port from 1 to 65535 that this user may open, found {first}")


NAMES = ("127.0.0.1", "localhost", "[::1]")  # Names of this machine that are allowed in an address

Process = Callable[[ServerConnection, Request], Awaitable[Response | None] | Response | None]


def refusal(path: str, headers: Headers, port: int, token: str) -> str | None:
    """Return why a request is refused; None if it is allowed."""
    hosts = [host.lower() for host in headers.get_all("Host")]
    ending = ("", ":80") if port == 80 else (f":{port}",)  # browsers leave out the port of http
    if len(hosts) != 1 or hosts[0] not in [name + end for name in NAMES for end in ending]:
        return f"This page is only available at {NAMES[0]}:{port} or {NAMES[1]}:{port}."
    if any(origin.lower() != f"http://{hosts[0]}" for origin in headers.get_all("Origin")):
        return "This page cannot be used from another site."
    given = path.partition("?")[0].removeprefix("/").partition("/")[0]
    if not secrets.compare_digest(given.encode(errors="surrogateescape"), token.encode()):
        return "Open the complete address that bisplat printed: the token at its end is missing or wrong."
    return None


@contextlib.contextmanager
def guard(token: str) -> Iterator[None]:
    """Make the server that viser starts within this block refuse requests before viser sees them.

    viser has no option for this. So the function of ``websockets`` that it calls is replaced within the block. Refused
    requests for pages and websockets get status 403, and their connection is closed. The address of the page is
    ``/TOKEN``. viser's page opens its websocket at the same address, so both have the token.
    """
    serve = websockets.asyncio.server.serve
    started: list[str] = []

    def serve_guarded(handler: Any, host: str, port: int, *, process_request: Process, **options: Any) -> Any:
        def admit(connection: ServerConnection, request: Request) -> Awaitable[Response | None] | Response | None:
            sentence = refusal(request.path, request.headers, connection.local_address[1], token)
            if sentence is not None:
                return connection.respond(HTTPStatus.FORBIDDEN, f"{sentence}\n")
            return process_request(connection, replace(request, path=request.path.removeprefix(f"/{token}")))

        started.append(host)
        return serve(handler, host, port, process_request=admit, **options)

    setattr(websockets.asyncio.server, "serve", serve_guarded)  # noqa: B010  mypy refuses to assign to a class
    try:
        yield
    finally:
        setattr(websockets.asyncio.server, "serve", serve)  # noqa: B010
    if not started:
        raise InputError(f"viser {version('viser')} serves pages in a way that cannot be protected; use version 1.1.1")


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
