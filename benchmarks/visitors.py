"""Checks that visitors without access read nothing, and that silent or flooding connections delay nobody.

    python -m benchmarks.visitors [--silent 200] [--seconds 5] [--no-browser]

The program starts the real server in a process of its own and tries to connect as other sites do: with a
foreign origin, `null`, another port's origin, a rebinding name, and with 40 sockets from a page of another
site in Chromium. Then, while a page is open, it opens many silent connections: half of them send no request,
and half are web sockets without a message. Another connection sends as fast as it can. Meanwhile a new
visitor connects. It prints JSON. The exit code is 0 if the foreign sites read, started and closed nothing,
the new visitor was served within 2 s, and the page kept at least half its rate.
"""

from __future__ import annotations

import argparse
import contextlib
import http.server
import json
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import sync_playwright
from viser import __version__
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import connect

from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web.server import PageServer
from browsing.browser_actions import CHROMIUM_ARGS, find_chromium
from browsing.wire import camera, let_in, messages_of, nothing_kept, pack
from lessons.scenes.run_spec import RunSpec

PROTOCOL: Any = [f"viser-v{__version__}"]
LONG = 60.0
_FOREIGN = """async ([url, protocol]) => {
  const one = () => new Promise((done) => {
    const socket = new WebSocket(url, [protocol]);
    socket.binaryType = "arraybuffer";
    let opened = 0;
    socket.onopen = () => { opened = 1; socket.send(new Uint8Array(CAMERA)); };
    socket.onclose = () => done(opened);
    setTimeout(() => done(opened), 10000);
  });
  const opened = await Promise.all(Array.from({length: 40}, one));
  return opened.reduce((a, b) => a + b, 0);
}"""


def serve(pipe: Any) -> None:
    """Runs the server's process, which reports its state on request until it is asked to end."""
    server = PageServer(SceneChoice(RunSpec("planar3-hold")), port=0, max_sessions=3, grace=600.0)
    pipe.send(server.link)
    while pipe.recv() == "seen":
        pipe.send(
            {
                "messages": server.guard.taken,
                "refused": server.guard.refused,
                "connections": len(server.guard.crowd),
                "learners": sorted(learner.token for learner in server.sessions.learners),
                "attached": sum(learner.attached for learner in server.sessions.learners),
            }
        )
    server.close()


class Watched:
    """An open page that counts the packets which arrive."""

    def __init__(self, url: str) -> None:
        self.packets = 0
        self._socket = connect(url.replace("http", "ws", 1), subprotocols=PROTOCOL, max_size=None)
        self._socket.send(pack(camera()))
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                raw = self._socket.recv()
                self.packets += 1
                if self.packets < 100 and isinstance(raw, bytes):
                    for message in messages_of(raw):
                        if message["type"] == "LocalStorageGetItemRequestMessage":
                            self._socket.send(pack(nothing_kept(message["request_uuid"])))

    def rate(self, seconds: float) -> float:
        """Returns the number of packets per second from now on."""
        before, began = self.packets, time.monotonic()
        time.sleep(seconds)
        return (self.packets - before) / (time.monotonic() - began)

    def close(self) -> None:
        self._socket.close()
        self._reader.join(5.0)


def shake(url: str, host: str, origin: str) -> int:
    """Sends a handshake together with a frame; returns the status of the response."""
    parts = urlsplit(url)
    lines = [
        f"GET /?{parts.query} HTTP/1.1",
        f"Host: {host}",
        f"Origin: {origin}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
        f"Sec-WebSocket-Protocol: {PROTOCOL[0]}",
    ]
    word = pack(camera())
    frame = b"\x82\xfe" + len(word).to_bytes(2, "big") + bytes(4) + word
    with socket.create_connection((parts.hostname or "", parts.port or 0), timeout=LONG) as stranger:
        stranger.sendall("\r\n".join([*lines, "", ""]).encode() + 50 * frame)
        return int((stranger.recv(100).split() or [b"", b"0"])[1])


def strangers(url: str) -> dict[str, int]:
    """Returns the status that each kind of foreign site gets, five times each."""
    ours = urlsplit(url).netloc
    kinds = {
        "foreign origin": (ours, "https://evil.example"),
        "null": (ours, "null"),
        "rebinding host": ("evil.example", "http://evil.example"),
        "other port": (ours, "http://127.0.0.1:1"),
    }
    return {kind: max(shake(url, host, origin) for _ in range(5)) for kind, (host, origin) in kinds.items()}


def from_chromium(url: str) -> int:
    """Returns how many of 40 sockets a page of another site in Chromium can open."""

    class Quiet(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>another site</title>")

        def log_message(self, format: str, *args: Any) -> None:
            """Prints nothing."""

    site = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet)
    threading.Thread(target=site.serve_forever, daemon=True).start()
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
            page = browser.new_page()
            page.goto(f"http://127.0.0.1:{site.server_address[1]}/")
            script = _FOREIGN.replace("CAMERA", json.dumps(list(pack(camera()))))
            opened: int = page.evaluate(script, [url.replace("http", "ws", 1), PROTOCOL[0]])
            browser.close()
    finally:
        site.shutdown()
        site.server_close()
    return opened


@contextlib.contextmanager
def besieged(url: str, silent: int) -> Iterator[subprocess.Popen[bytes]]:
    """Opens silent connections, and starts a process whose connection floods the server."""
    parts = urlsplit(url)
    address = (parts.hostname or "", parts.port or 0)
    with contextlib.ExitStack() as stack:
        for _ in range(silent // 2):
            stack.enter_context(socket.create_connection(address, timeout=LONG))
        mute = []
        for _ in range(silent - silent // 2):
            with contextlib.suppress(InvalidHandshake, OSError):
                mute.append(connect(url.replace("http", "ws", 1), subprotocols=PROTOCOL, max_size=None))
        flood = subprocess.Popen([sys.executable, "-m", "benchmarks.visitors", "--flood", url])
        try:
            yield flood
        finally:
            flood.kill()
            flood.wait()
            for each in mute:
                with contextlib.suppress(Exception):
                    each.socket.close()


def flood(url: str) -> None:
    """Sends as fast as possible, and connects again after each disconnection."""
    word = pack(camera())
    while True:
        with (
            contextlib.suppress(ConnectionClosed, InvalidHandshake, OSError, EOFError, TimeoutError),
            connect(url.replace("http", "ws", 1), subprotocols=PROTOCOL, max_size=None) as socket_,
        ):
            threading.Thread(target=_drain, args=(socket_,), daemon=True).start()
            while True:
                socket_.send(word)


def _drain(connection: Any) -> None:
    with contextlib.suppress(ConnectionClosed):
        for _ in connection:
            pass


def newcomer(url: str) -> float:
    """Returns the time, s, until a new page is served: the document, the socket, and the first packet after
    its first message."""
    parts, cookie = urlsplit(url), let_in(url)
    began = time.monotonic()
    with socket.create_connection((parts.hostname or "", parts.port or 0), timeout=LONG) as plain:
        lines = ["GET / HTTP/1.1", f"Host: {parts.netloc}", f"Cookie: {cookie}", "Accept-Encoding: gzip"]
        plain.sendall("\r\n".join([*lines, "", ""]).encode())
        while plain.recv(65536):
            pass
    with connect(
        url.replace("http", "ws", 1), subprotocols=PROTOCOL, max_size=None, open_timeout=LONG
    ) as page:
        page.send(pack(camera()))
        while True:
            raw = page.recv(timeout=LONG)
            kinds = {message["type"] for message in messages_of(raw)} if isinstance(raw, bytes) else set()
            if "LocalStorageGetItemRequestMessage" in kinds:
                return time.monotonic() - began


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--silent", type=int, default=200, metavar="K")
    parser.add_argument("--seconds", type=float, default=5.0, help="length of each measurement of the rate")
    parser.add_argument("--no-browser", action="store_true", help="runs without Chromium")
    parser.add_argument("--flood", metavar="URL", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.flood:
        flood(options.flood)
    import multiprocessing

    context = multiprocessing.get_context("spawn")
    pipe, theirs = context.Pipe()
    server = context.Process(target=serve, args=(theirs,))
    server.start()
    url: str = pipe.recv()

    def seen() -> dict[str, Any]:
        pipe.send("seen")
        return pipe.recv()

    try:
        pages = [Watched(url), Watched(url)]
        wait_until(lambda: seen()["attached"] == 2, LONG)
        pages.pop().close()  # one page reloads: its place must be reserved
        wait_until(lambda: seen()["attached"] == 1, LONG)
        page = pages[0]
        time.sleep(3.0)
        before = seen()
        result: dict[str, Any] = {"answers": strangers(url)}
        if not options.no_browser:
            result["opened_in_chromium"] = from_chromium(url)
        after = seen()
        result["messages_read"] = after["messages"] - before["messages"]
        result["learners_before_after"] = [len(before["learners"]), len(after["learners"])]
        admitted = (
            after["learners"] != before["learners"]
            or result["messages_read"]
            or result.get("opened_in_chromium")
            or set(result["answers"].values()) != {403}
        )
        free = page.rate(options.seconds)
        with besieged(url, options.silent):
            time.sleep(1.0)
            result["connections"] = seen()["connections"]
            besieged_rate = page.rate(options.seconds)
            result["newcomer_s"] = [round(newcomer(url), 2) for _ in range(3)]
            besieged_rate = min(besieged_rate, page.rate(options.seconds))
        # The page may still have been starting during the first measurement, and the machine is shared, so
        # the better of both rates counts.
        time.sleep(2.0)
        free = max(free, page.rate(options.seconds))
        result["packets_hz"] = {"free": round(free, 1), "besieged": round(besieged_rate, 1)}
        result["kept"] = round(besieged_rate / free, 2) if free else 0.0
        page.close()
    finally:
        pipe.send("end")
        server.join(LONG)
    print(json.dumps(result, indent=2))
    return int(bool(admitted) or max(result["newcomer_s"]) > 2.0 or result["kept"] < 0.5)


if __name__ == "__main__":
    sys.exit(main())
