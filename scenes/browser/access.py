"""Access control for a page that viser serves. Only browsers and programs with the printed address may open it.

Any website that the user visits can send requests to 127.0.0.1, and can give this address a name of its own (DNS
rebinding). The headers Host and Origin reveal such requests. The token in the address also keeps out programs of other
users on this machine.
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
"""Names of this machine that are allowed in an address."""

Process = Callable[[ServerConnection, Request], Awaitable[Response | None] | Response | None]


def refusal(path: str, headers: Headers, port: int, token: str) -> str | None:
    """Return why a request is refused; None if it is allowed.

    >>> refusal("/secret", Headers(Host="127.0.0.1:8080"), 8080, "secret") is None
    True
    >>> refusal("/secret", Headers(Host="127.0.0.1:8080", Origin="http://elsewhere.org"), 8080, "secret")
    'This page cannot be used from another site.'
    """
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
