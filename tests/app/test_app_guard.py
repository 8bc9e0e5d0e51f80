"""Access control and budgets of viser's server, with real connections."""

from __future__ import annotations

import asyncio
import gc
import http.client
import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from served import LONG, get, served
from viser import ViserServer, __version__
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection

from app.adapter import private
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web import limits
from app.web.guard import FIRST_WORD, GuardedConnection
from app.web.limits import Bucket, Budget, ConnectionLimits
from app.web.passes import QUERY
from app.web.server import PageServer, ServerOptions
from app.web.visit import Visit
from browsing.wire import camera, let_in, pack
from lessons.own.files import Folder
from lessons.scenes.run_spec import RunSpec

PROTOCOL: Any = [f"viser-v{__version__}"]


@pytest.fixture(scope="module")
def plain() -> Iterator[PageServer]:
    with served(max_sessions=2, grace=60.0) as running:
        yield running


def dial(server: PageServer, **more: Any) -> ClientConnection:
    return connect(server.link.replace("http", "ws", 1), subprotocols=PROTOCOL, max_size=None, **more)


def closed_with(page: Connection) -> int | None:
    """Reads all remaining messages and returns the code with which the connection was closed."""
    try:
        while True:
            page.recv(timeout=LONG)
    except ConnectionClosed:
        return page.close_code


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:9"},
        {"Host": "evil.example", "Origin": "http://evil.example"},
    ],
    ids=str,
)
def test_who_is_not_admitted_reaches_nothing(plain: PageServer, headers: dict[str, str]) -> None:
    """A refused visitor gets no socket, no frame, no learner and no process."""
    learners, taken = plain.sessions.learners, plain.guard.taken
    host = headers.get("Host", urlsplit(plain.url).netloc)
    with socket.create_connection((urlsplit(plain.url).hostname, urlsplit(plain.url).port)) as stranger:
        lines = [
            f"GET /?{urlsplit(plain.link).query} HTTP/1.1",
            f"Host: {host}",
            f"Origin: {headers['Origin']}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
            f"Sec-WebSocket-Protocol: {PROTOCOL[0]}",
        ]
        # A frame that is sent along with the handshake is not read either.
        stranger.sendall("\r\n".join([*lines, "", ""]).encode() + b"\x82\x80\x00\x00\x00\x00")
        answer = stranger.recv(100)
        assert answer.startswith(b"HTTP/1.1 403 ")
    assert get(plain.link, **headers).status == 403
    assert plain.sessions.learners == learners and plain.guard.taken == taken


def test_every_answer_forbids_frames_and_guesses(plain: PageServer) -> None:
    for answer in (
        get(plain.url),
        get(plain.url, Cookie=let_in(plain.link)),
        get(f"{plain.url}/nowhere", Cookie=let_in(plain.link)),
        get(plain.link, Origin="null"),
    ):
        assert answer.headers["Content-Security-Policy"] == "frame-ancestors 'none'"
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert "Server" not in answer.headers
    with dial(plain) as page:
        assert page.response is not None
        assert page.response.headers["X-Content-Type-Options"] == "nosniff"


def test_without_the_token_nothing_opens(plain: PageServer) -> None:
    """The token is also required on this machine, which may have other users. With the token, page and socket
    open from the address or the cookie. Both pages work below any path: they refer to no absolute address."""
    server, absolute = plain, re.compile(r'(?:href|action|src)="/')
    learners, taken = server.sessions.learners, server.guard.taken
    refused = get(server.url)
    assert refused.status == 403
    assert f"?{QUERY}=" in refused.text and not absolute.search(refused.text)
    with pytest.raises(InvalidStatus) as error:
        connect(server.url.replace("http", "ws"), subprotocols=PROTOCOL)
    assert error.value.response.status_code == 403
    assert server.sessions.learners == learners and server.guard.taken == taken
    answer = get(server.link)
    assert (answer.status, answer.headers["Location"]) == (303, "./")
    cookie = answer.headers["Set-Cookie"].partition(";")[0]
    assert str(server.passes.token) not in cookie
    answer = get(server.url, Cookie=cookie)
    assert answer.status == 200 and not absolute.search(answer.text)
    own: Any = {"additional_headers": {"Cookie": cookie}, "origin": server.url}
    with connect(server.url.replace("http", "ws"), subprotocols=PROTOCOL, max_size=None, **own) as page:
        assert page.recv(timeout=LONG)
    with dial(server) as page:
        assert page.recv(timeout=LONG)


def test_no_token_lets_everybody_in() -> None:
    """If no token is needed, no visitor counts as the owner."""
    with served(ask_token=False, own_files=Folder.at(".")) as server:
        assert server.guest_link == server.url != server.link
        assert get(server.url).status == 200
        with connect(server.url.replace("http", "ws"), subprotocols=PROTOCOL) as page:
            page.send(pack(camera()))
            assert wait_until(lambda: bool(server._viser.get_clients()), LONG)
            (client,) = server._viser.get_clients().values()
            line = private.connection_of(server._viser, client)
            assert isinstance(line, GuardedConnection) and not line.is_owners


def test_cookies_of_two_servers_live_in_one_jar() -> None:
    """A browser sends the cookies of both servers to each server, as they have different names. The value of
    one does not open the other server."""
    with served() as one, served() as other:
        cookies = [let_in(server.link) for server in (one, other)]
        (name, value), (other_name, other_value) = (each.split("=", 1) for each in cookies)
        assert name != other_name and value != other_value
        assert get(one.url, Cookie="; ".join(cookies)).status == 200
        assert get(one.url, Cookie=f"{name}={other_value}").status == 403


@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0, reason="needs another user: run it as root")
def test_a_cookie_that_another_user_has_seen_opens_nothing(plain: PageServer) -> None:
    """Cookies do not depend on the port: a browser sends them to the servers of all users of a machine."""
    cookie = let_in(plain.link)
    assert get(plain.url, Cookie=cookie).status == 200
    code = (  # all imports come first, because the other user may not be able to read the modules
        "import encodings.idna, os, socket, sys; os.setuid(65534); "
        "line = socket.create_connection(('127.0.0.1', int(sys.argv[1]))); "
        "line.sendall('\\r\\n'.join(['GET / HTTP/1.1', 'Host: 127.0.0.1', 'Cookie: ' + sys.argv[2], '', ''])"
        ".encode()); "
        "print(line.recv(100).split()[1].decode())"
    )
    port = str(urlsplit(plain.url).port)
    done = subprocess.run(
        [sys.executable, "-c", code, port, cookie], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "403"


def test_a_message_has_a_size(plain: PageServer) -> None:
    with dial(plain) as page:
        page.send(bytes(limits.MESSAGE + 1))
        assert closed_with(page) == 1009
    with dial(plain) as page:
        page.send("text")
        assert closed_with(page) == 1003


def test_two_thousand_pings_end_a_connection(plain: PageServer) -> None:
    with dial(plain) as page, pytest.raises(ConnectionClosed):
        for _ in range(2000):
            page.ping()
        closed_with(page)
        page.ping()


def test_a_bucket_is_paid_for_by_waiting() -> None:
    now = [0.0]
    bucket = Bucket(rate=10.0, size=20.0, now=lambda: now[0])
    assert [bucket.take(1.0) for _ in range(20)] == [0.0] * 20
    assert bucket.take(1.0) == pytest.approx(0.1)
    now[0] += 0.1
    assert bucket.take(0.0) == 0.0
    now[0] += 100.0
    assert bucket.take(20.0) == 0.0 and bucket.take(1.0) > 0.0


def test_who_drags_never_waits_and_who_floods_is_ended() -> None:
    now = [0.0]
    spent = Budget(lambda: now[0])
    for _ in range(10 * 100):  # a minute of dragging and rotating at once needs no more than this per second
        now[0] += 0.01
        assert spent.wait(300) == 0.0
    flooded = 0
    while not spent.spent:
        now[0] += spent.wait(300)
        flooded += 1
        assert flooded < limits.BURST + 1.5 * limits.PATIENCE * limits.MESSAGES


def test_files_that_are_complete_hold_nothing() -> None:
    spent = Budget(lambda: 0.0)
    assert all(spent.uploads(limits.UPLOADS // 5, lambda: 0) for _ in range(20))
    full = Budget(lambda: 0.0)
    assert not all(full.uploads(limits.UPLOADS // 5, lambda: limits.UPLOADS) for _ in range(6))


def test_the_silent_make_room() -> None:
    crowd, left = ConnectionLimits(total=4, per_address=2), []
    for key in "ab":
        assert crowd.enter(key, "1", lambda key=key: left.append(key))
    crowd.spoke("b")
    assert crowd.enter("c", "1", lambda: left.append("c"))
    assert left == ["a"]  # the oldest silent connection
    crowd.spoke("c")
    assert not crowd.enter("d", "1", lambda: None)  # all connections have sent a message
    assert crowd.enter("e", "2", lambda: left.append("e")) and crowd.enter("f", None, lambda: None)
    assert crowd.enter("g", "3", lambda: None)
    assert left == ["a", "e"] and len(crowd) == 4
    assert not crowd.comes_from("f", "1")
    crowd.leave("c")
    assert crowd.comes_from("f", "1")


def test_no_process_stays_if_the_server_cannot_be_made(monkeypatch: pytest.MonkeyPatch) -> None:
    from app.web import server as module

    made: list[Any] = []

    class Sessions(module.Sessions):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            made.append(self)
            self.enter([])

    monkeypatch.setattr(module, "Sessions", Sessions)
    monkeypatch.setattr(private, "open_server", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        PageServer(SceneChoice(RunSpec("planar3-hold")), ServerOptions(port=0))
    (sessions,) = made
    assert sessions.enter([]) is None and not sessions.learners


def test_a_page_that_says_nothing_leaves_no_noise_at_the_end(caplog: pytest.LogCaptureFixture) -> None:
    """The server is closed while it still waits for the page's answer about its local storage."""
    with served() as server, dial(server) as page:
        page.send(pack(camera()))
        assert wait_until(lambda: server.guard.taken > 0, LONG)
        server.close()
    gc.collect()
    assert not [record for record in caplog.records if record.name == "asyncio"]


def test_a_page_that_comes_while_the_server_closes_leaves_no_noise(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The visit of a page ends before it has asked the page anything. It does not wait for an answer."""
    came, left, ended = threading.Event(), threading.Event(), threading.Event()
    arrive, leave, stop = Visit.arrive, Visit.leave, private.stop

    async def late(visit: Visit) -> None:
        came.set()
        while not left.is_set():
            await asyncio.sleep(0.01)
        await arrive(visit)
        ended.set()

    def leaves(visit: Visit) -> None:
        leave(visit)
        left.set()

    def stops(server: ViserServer) -> None:
        assert ended.wait(LONG)  # without this, the loop may stop while `late` sleeps
        stop(server)

    monkeypatch.setattr("app.web.visit.STORAGE", 10 * LONG)  # a question that is not withdrawn stays open
    monkeypatch.setattr(Visit, "arrive", late)
    monkeypatch.setattr(Visit, "leave", leaves)
    monkeypatch.setattr(private, "stop", stops)
    with served() as server, dial(server) as page:
        page.send(pack(camera()))
        assert came.wait(LONG)
        server.close()
    gc.collect()
    assert not [record for record in caplog.records if record.name == "asyncio"]


def test_a_page_that_is_gone_is_forgotten_at_once(plain: PageServer) -> None:
    """A closed page is released from memory at once, although the timeout for its first message has not
    passed."""

    def held() -> int:
        gc.collect()
        return sum(type(each) is GuardedConnection for each in gc.get_objects())

    assert wait_until(lambda: not held(), 0.6 * FIRST_WORD, 0.5)
    for _ in range(3):
        with dial(plain) as page:
            page.send(pack(camera()))
            page.recv(timeout=LONG)
    assert wait_until(lambda: not held(), 0.6 * FIRST_WORD, 0.5)


def test_whoever_needs_longer_than_the_handshake_is_let_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """A connection that sends no request is closed after the timeout of the handshake."""
    monkeypatch.setattr("app.web.guard.HANDSHAKE", 0.5)
    with served() as server:
        where = urlsplit(server.url)
        with socket.create_connection((where.hostname, where.port), timeout=LONG) as silent:
            assert silent.recv(1) == b""


def answer_to(server: PageServer, request: str) -> tuple[int, dict[str, str], bytes]:
    """Returns status, headers and content of the answer to a request that is sent as it is."""
    where = urlsplit(server.url)
    with socket.create_connection((where.hostname, where.port), timeout=LONG) as line:
        line.sendall(request.encode())
        answer = http.client.HTTPResponse(line, method=request.partition(" ")[0])
        answer.begin()
        return answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()


def test_a_head_request_is_answered_like_get_without_content(plain: PageServer) -> None:
    host = f"Host: {urlsplit(plain.url).netloc}\r\n\r\n"
    for path in ("/health", "/metrics", "/"):
        found = {
            method: answer_to(plain, f"{method} {path} HTTP/1.1\r\n{host}") for method in ("GET", "HEAD")
        }
        assert found["GET"][0] == found["HEAD"][0] and found["GET"][2]
        assert int(found["HEAD"][1]["content-length"]) > 0
    where = urlsplit(plain.url)
    with socket.create_connection((where.hostname, where.port), timeout=LONG) as line:
        line.sendall(f"HEAD /health HTTP/1.1\r\n{host}".encode())
        assert b"".join(iter(lambda: line.recv(4096), b"")).endswith(b"\r\n\r\n"), "no content"
    upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\n"
    assert answer_to(plain, f"HEAD / HTTP/1.1\r\n{upgrade}{host}")[0] == 405


def test_a_monitor_may_use_http_1_0(plain: PageServer) -> None:
    """It need not name a host, but a host that it names must be this server."""
    assert answer_to(plain, "GET /health HTTP/1.0\r\n\r\n")[0] == 200
    assert answer_to(plain, "HEAD /metrics HTTP/1.0\r\n\r\n")[0] == 200
    assert answer_to(plain, "GET /health HTTP/1.0\r\nHost: evil.example\r\n\r\n")[0] == 403
    assert answer_to(plain, "GET / HTTP/1.0\r\n\r\n")[0] == 505
    assert answer_to(plain, "GET /health HTTP/1.1\r\n\r\n")[0] == 403


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "CONNECT"])
def test_other_methods_get_405(plain: PageServer, method: str) -> None:
    host = f"Host: {urlsplit(plain.url).netloc}\r\n"
    for more in ("\r\n", "Content-Length: 4\r\n\r\nabcd"):
        status, head, content = answer_to(plain, f"{method} / HTTP/1.1\r\n{host}{more}")
        assert (status, head["allow"]) == (405, "GET, HEAD") and b"GET and HEAD only" in content
        assert head["x-content-type-options"] == "nosniff"
