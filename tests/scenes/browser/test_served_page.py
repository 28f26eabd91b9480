"""A page of viser without a browser: whom it lets in, many tabs, tabs that go away, and errors in a tab."""

import socket
import threading
import time
from collections.abc import Callable
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import InvalidStatus

from scenes.browser.served_page import guard, serving, shield
from scenes.files.errors import InputError, ParameterError

PORT = 8660


class Tabs:
    """What the page did with its tabs."""

    def __init__(self):
        self.opened, self.closed = [], []

    def open_tab(self, client):
        self.opened.append(client.client_id)
        client.gui.add_markdown("hello")
        return lambda: self.closed.append(client.client_id)


@pytest.fixture
def tabs():
    return Tabs()


@pytest.fixture
def address(tabs):
    with serving("a page", PORT, tabs.open_tab) as address:
        yield address


def get(address: str, path: str | None = None, **headers: str) -> tuple[int, str]:
    """Status and text of a page."""
    url = urlsplit(address)
    connection = HTTPConnection(url.hostname, url.port, timeout=5)
    connection.request("GET", url.path if path is None else path, headers=headers)
    response = connection.getresponse()
    return response.status, response.read().decode()


def wait_until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "LOCALHOST", "[::1]"])
def test_a_browser_on_this_machine_with_the_address_is_let_in(address, join, tabs, name):
    port = urlsplit(address).port
    assert get(address, Host=f"{name}:{port}")[0] == 200
    assert get(f"{address}?darkMode=1")[0] == 200 and get(f"{address}/")[0] == 200
    with join(address, f"{name}:{port}", origin=f"http://{name}:{port}"):
        wait_until(lambda: tabs.opened)


OTHERS = {
    "other site": {"origin": "http://elsewhere.org"},
    "opaque origin": {"origin": "null"},
    "other page of this machine": {"origin": "http://127.0.0.1:9"},
    "encrypted": {"origin": f"https://127.0.0.1:{PORT}"},
    "rebound name": {"host": f"elsewhere.org:{PORT}"},
    "rebound name and origin": {"host": f"elsewhere.org:{PORT}", "origin": f"http://elsewhere.org:{PORT}"},
    "name that only begins so": {"host": f"localhost.elsewhere.org:{PORT}"},
    "other port": {"host": "127.0.0.1:80"},
}


@pytest.mark.parametrize("what", OTHERS)
def test_others_are_refused_before_a_tab_is_made(address, join, tabs, what):
    forged = {**OTHERS[what]}
    with pytest.raises(InvalidStatus) as refused:
        join(address, **forged)
    assert refused.value.response.status_code == 403
    headers = {"Host": forged.get("host", urlsplit(address).netloc)}
    if "origin" in forged:
        headers["Origin"] = forged["origin"]
    status, sentence = get(address, **headers)
    assert status == 403 and sentence.startswith("This page ") and sentence.count("\n") == 1
    with join(address):  # the page goes on
        wait_until(lambda: tabs.opened)
    assert len(tabs.opened) == 1


@pytest.mark.parametrize("token", ["", "/", "/wrong", "/index.html", "//{token}", "/{token}x", "/wrong/{token}", "/é"])
def test_without_the_token_nobody_is_let_in(address, join, tabs, token):
    url = urlsplit(address)
    path = token.format(token=url.path[1:])
    with pytest.raises(InvalidStatus) as refused:
        join(f"http://{url.netloc}{path.replace('é', '%C3%A9')}")
    assert refused.value.response.status_code == 403
    if path.isascii() and path:
        status, sentence = get(address, path)
        assert status == 403 and sentence.startswith("Open the complete address that bisplat printed")
    assert not tabs.opened


def test_bytes_that_are_no_text_are_refused(address):
    url = urlsplit(address)
    with socket.create_connection((url.hostname, url.port)) as raw:
        raw.sendall(f"GET /\xe9 HTTP/1.1\r\nHost: {url.netloc}\r\n\r\n".encode("latin-1"))
        assert b" 403 " in raw.recv(100) or b" 400 " in raw.recv(100)


def test_a_second_host_is_refused(address):
    url = urlsplit(address)
    with socket.create_connection((url.hostname, url.port)) as raw:
        raw.sendall(f"GET {url.path} HTTP/1.1\r\nHost: {url.netloc}\r\nHost: elsewhere.org\r\n\r\n".encode())
        assert b" 403 " in raw.recv(100)


def test_two_pages_have_tokens_of_their_own(address, capsys):
    with serving("another", PORT, lambda client: None) as other:
        assert urlsplit(other).port > PORT and f"port {PORT} is taken" in capsys.readouterr().err
        assert urlsplit(other).path != urlsplit(address).path and len(urlsplit(other).path) > 40
        assert get(other, urlsplit(address).path)[0] == 403


def test_twenty_tabs_of_which_some_go_away_midway(address, join, tabs):
    joined = [join(address) for _ in range(20)]
    for tab in joined[:5]:
        tab.break_off()
    wait_until(lambda: len(tabs.opened) == 20)
    wait_until(lambda: len(tabs.closed) == 5)
    assert all(tab.next("GuiMarkdownMessage") for tab in joined[5:])
    for tab in joined[5:]:
        tab.close()
    wait_until(lambda: sorted(tabs.closed) == list(range(20)))


def test_tab_that_is_gone_before_it_was_built_is_closed(join):
    going, tabs = threading.Event(), Tabs()

    def open_slowly(client):
        assert going.wait(10)
        return tabs.open_tab(client)

    with serving("slow", PORT, open_slowly) as address:
        join(address).close()
        time.sleep(0.2)
        going.set()
        wait_until(lambda: tabs.closed == tabs.opened == [0])


@pytest.mark.parametrize("error", [InputError("no such\x1b[31m wall"), RuntimeError("no such\x1b[31m wall")])
@pytest.mark.parametrize("kind", ["function", "coroutine"])
def test_errors_of_callbacks_are_shown_and_the_tab_goes_on(error, kind, join):
    pressed = []

    def fail(event):
        pressed.append(event)
        raise error

    async def fail_later(event):
        fail(event)

    def open_tab(client):
        button = client.gui.add_button("Save")
        button.on_click(shield(client, fail if kind == "function" else fail_later))

    with serving("fails", PORT, open_tab) as address, join(address) as tab:
        for count in (1, 2):
            tab.press("Save")
            notification = tab.next("NotificationShowMessage")["props"]
            assert notification["body"].endswith(r"no such\x1b[31m wall") and len(pressed) == count
        assert ("RuntimeError" in notification["body"]) == isinstance(error, RuntimeError)


def test_a_server_that_is_started_in_another_way_is_refused():
    with pytest.raises(InputError, match="cannot be protected"), guard("token"):
        pass


@pytest.mark.parametrize("port", [0, 65536, 65535], ids=["zero", "too high", "taken, and the last"])
def test_ports_that_are_none(port):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 65535))
        taken.listen()
        with pytest.raises(ParameterError, match=f"found {port}"):
            serving("a page", port, lambda client: None).__enter__()
