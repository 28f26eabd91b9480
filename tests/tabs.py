"""A fixture for pages without a browser: a tab that receives what viser sends and presses buttons."""

import socket
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import pytest

CAMERA = {
    "type": "ViewerCameraMessage",
    **{"wxyz": (1.0, 0.0, 0.0, 0.0), "position": (0.0, 0.0, 0.0), "look_at": (1.0, 0.0, 0.0)},
    **{"up_direction": (0.0, 0.0, 1.0), "fov": 0.8, "near": 0.1, "far": 10.0, "image_height": 6, "image_width": 8},
}
"""What a tab of viser says first."""


def _label(message: dict[str, Any]) -> Any:
    return (message.get("props") or message.get("updates") or {}).get("label")


class Tab:
    """A tab without a browser: what viser sends it, and buttons that are pressed."""

    def __init__(self, address: str, host: str | None, **options: Any):
        import viser
        from websockets.sync.client import connect

        url = urlsplit(address)
        uri, sock = f"ws://{host or url.netloc}{url.path}", socket.create_connection((url.hostname, url.port))
        protocol: Any = f"viser-v{viser.__version__}"
        self._websocket = connect(uri, sock=sock, subprotocols=[protocol], max_size=None, **options)
        self._messages: list[dict[str, Any]] = []
        self._seen: dict[str, int] = {}
        self._send(CAMERA)

    def __enter__(self) -> "Tab":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """As when the user closes it."""
        self._websocket.close()

    def break_off(self) -> None:
        """As when the machine goes away: without a farewell."""
        self._websocket.socket.shutdown(socket.SHUT_RDWR)

    def next(self, kind: str) -> dict[str, Any]:
        """The next message of a kind."""
        seen = self._seen.get(kind, 0)
        while not (new := [n for n, m in enumerate(self._messages) if n >= seen and m["type"] == kind]):
            self._receive()
        self._seen[kind] = new[0] + 1
        return self._messages[new[0]]

    def press(self, label: str) -> None:
        """Press a button, which may be made or named so later."""
        while not (found := [m for m in self._messages if _label(m) == label]):
            self._receive()
        self._send({"type": "GuiUpdateMessage", "uuid": found[0]["uuid"], "updates": {"value": True}})

    def drag(self, name: str, position: tuple[float, ...], wxyz: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> None:
        """Drag a handle, which may be made later, to a position and an orientation."""
        while not (
            found := [m for m in self._messages if m["type"] == "TransformControlsMessage" and m["name"] == name]
        ):
            self._receive()
        owner = found[0].get("owner", "")
        moved = {"type": "TransformControlsUpdateMessage", "name": name, "position": position, "wxyz": wxyz}
        self._send(moved | {"owner": owner})

    def _send(self, message: dict[str, Any]) -> None:
        import msgspec

        self._websocket.send(msgspec.msgpack.encode(message))

    def _receive(self) -> None:
        import msgspec
        import zstandard

        packed = self._websocket.recv(timeout=10)
        assert isinstance(packed, bytes)
        size = int.from_bytes(packed[8:16], "little")
        self._messages += msgspec.msgpack.decode(zstandard.decompress(packed[16 : 16 + size]))["messages"]


@pytest.fixture
def join() -> Callable[..., Tab]:
    """Function: address of a page, the host that is named (the address's), options of ``connect`` -> a tab."""
    return lambda address, host=None, **options: Tab(address, host, **options)
