"""Who may enter a page that viser serves: a browser, or a program, on this machine that has the printed address.

Any web site that the user visits can send requests to 127.0.0.1, and can give that address a name of its own (DNS
rebinding). The Host and Origin headers tell such requests; the token in the address also keeps out the programs of
other users.
"""

from __future__ import annotations

import contextlib
import secrets
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from http import HTTPStatus
from importlib.metadata import version
from typing import Any

import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from scenes.files.errors import InputError

NAMES = ("127.0.0.1", "localhost", "[::1]")
"""Names of this machine in an address that is let in."""

Process = Callable[[ServerConnection, Request], Awaitable[Response | None] | Response | None]


def refusal(path: str, headers: Headers, port: int, token: str) -> str | None:
    """Why a request is not let in; None: it is.

    Args:
        path: of the request, with its query.
        headers: of the request.
        port: that the page is served at.
        token: that the path must begin with.

    >>> refusal("/secret", Headers(Host="127.0.0.1:8080"), 8080, "secret") is None
    True
    >>> refusal("/secret", Headers(Host="127.0.0.1:8080", Origin="http://elsewhere.org"), 8080, "secret")
    'This page was asked for by another site.'
    """
    hosts = [host.lower() for host in headers.get_all("Host")]
    ending = ("", ":80") if port == 80 else (f":{port}",)  # browsers leave out the port of http
    if len(hosts) != 1 or hosts[0] not in [name + end for name in NAMES for end in ending]:
        return f"This page is only at {NAMES[0]}:{port} or {NAMES[1]}:{port}, and under no other name."
    if any(origin.lower() != f"http://{hosts[0]}" for origin in headers.get_all("Origin")):
        return "This page was asked for by another site."
    given = path.partition("?")[0].removeprefix("/").partition("/")[0]
    if not secrets.compare_digest(given.encode(errors="surrogateescape"), token.encode()):
        return "Open the whole address that bisplat printed: the token at its end is missing or wrong."
    return None


@contextlib.contextmanager
def guard(token: str) -> Iterator[None]:
    """Let the server that viser starts within this block refuse requests, before viser sees them.

    viser has no option for this, so the function of ``websockets`` that it calls is replaced meanwhile. Pages and
    websockets are refused with status 403, and the connection is closed. The address of the page is ``/TOKEN``, and
    viser's page opens its websocket at its own address, so that both have the token.

    Args:
        token: that the path of every request must begin with.

    Raises:
        InputError: viser has started its server in another way, so that it is not guarded; the command then ends.
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
        raise InputError(f"viser {version('viser')} serves pages in a way that cannot be guarded; use version 1.1.1")
