"""Runs three servers of two sessions each behind a real nginx, with the configuration that docs/serving.md
prints.

    python -m benchmarks.several [--picture FILE]

Six learners connect, one of them in a browser, and the seventh learner is asked to wait. Two learners leave.
Then the server of the learner in the browser is killed. Its two learners continue on another server, at the
same step of the lesson. The program prints after how many seconds they continue. At the end, another server
receives SIGTERM. It then admits nobody, and its page is informed and continues on another server. The exit
code is 0 if all of this happened and each learner of the killed server continued within 10 s.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from playwright.sync_api import Page, sync_playwright
from websockets.exceptions import InvalidStatus

from app.server.passes import QUERY, VARIABLE
from browsing.browser_actions import CHROMIUM_ARGS, find_chromium, new_page, wait_for_scene
from browsing.tab import Storage, Tab, opened
from browsing.wire import eventually

ROOT = Path(__file__).parents[1]
SERVERS, SESSIONS, DRAIN = 3, 2, 5
MOVE = 10.0
"""Time, s, within which a learner continues on another server."""
_LONG = 180.0  # s
_TOKEN = "one-token-for-all-three-servers"
_HERE = "lab-{}.example.org:8080"


def main() -> int:
    """Runs the servers, and prints what happened to the learners."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path, default=None)
    picture: Path | None = parser.parse_args().picture
    nginx = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin:/usr/local/sbin")
    chromium = find_chromium()
    if nginx is None or chromium is None:
        print("This benchmark needs nginx and Chromium.", file=sys.stderr)
        return 2
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        port, ports = _free_port(), [_free_port() for _ in range(SERVERS)]
        link = f"http://127.0.0.1:{port}/?{QUERY}={_TOKEN}"
        servers = [stack.enter_context(_server(each, port)) for each in ports]
        stack.enter_context(_balancer(nginx, folder, port, ports))
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(executable_path=chromium, args=CHROMIUM_ARGS)
        failures = _learn(stack, link, new_page(browser, 1300, 700), ports, servers, picture)
        browser.close()
    for each in failures:
        print(f"this was not the case: {each}")
    return 1 if failures else 0


def _learn(
    stack: ExitStack,
    link: str,
    page: Page,
    ports: list[int],
    servers: list[subprocess.Popen[bytes]],
    picture: Path | None,
) -> list[str]:
    """Does everything in sequence, and returns what went wrong."""
    wrong: list[str] = []

    def check(right: bool, words: str) -> None:
        wrong.extend([] if right else [words])

    storages = [Storage() for _ in range(5)]
    page.goto(link)
    wait_for_scene(page)
    (home,) = (place for place in range(SERVERS) if _sessions(ports[place]) == 1)
    tabs = [stack.enter_context(opened(link, each, _LONG)) for each in storages]
    check(
        eventually(lambda: [_sessions(each) for each in ports] == [SESSIONS] * SERVERS, _LONG),
        "six learners have places",
    )
    print("learners per server:", *(_sessions(each) for each in ports))
    try:
        Tab(link, Storage())
        check(False, "the seventh is not let in")
    except InvalidStatus as refused:
        check(refused.response.status_code == 503, "the seventh gets 503")
    check(_asked_to_wait(link), "the page of the seventh tries again by itself")
    # Every page goes to the second step of its lesson.
    page.keyboard.press("n")
    for each in tabs:
        assert eventually(lambda tab=each: _commands(tab), _LONG)
        each.press_key("N")
    at_second = [eventually(lambda kept=each: _step(kept) == 2, _LONG) for each in storages]
    check(all(at_second), "every tab keeps its step")
    assert eventually(lambda: _step_of(page) == 2, _LONG)
    # Two learners leave, one from each of the other servers, so that there is room for two.
    places = [_place_of(each, ports) for each in tabs]
    (companion,) = (k for k, place in enumerate(places) if place == home)
    for other in (place for place in range(SERVERS) if place != home):
        tabs[places.index(other)].__exit__()
    rest = [port for place, port in enumerate(ports) if place != home]
    check(eventually(lambda: [_sessions(each) for each in rest] == [1, 1], _LONG), "two learners have left")
    servers[home].send_signal(signal.SIGKILL)
    began = time.monotonic()
    moved, there = _again(stack, tabs[companion], link)
    check(there, "the learner is at the second step")
    print(f"killed: the learner of a protocol client continues after {time.monotonic() - began:.1f} s")
    check(time.monotonic() - began < MOVE, "the protocol client changes servers in time")
    in_browser = _until(lambda: [_sessions(each) for each in rest] == [2, 2], page)
    shown = _until(lambda: page.get_by_text("You continue where you were").count() > 0, page)
    check(in_browser and shown, "the learner in the browser continues on another server")
    page.get_by_text("2 of").first.wait_for()
    print(f"killed: the page in the browser continues after {time.monotonic() - began:.1f} s")
    check(time.monotonic() - began < MOVE, "the browser changes servers in time")
    if picture is not None:
        page.screenshot(path=picture)
    page.context.close()
    check(
        eventually(lambda: sum(_sessions(each) for each in rest) == 3, _LONG),
        "the browser's place is free",
    )
    wrong += _drained(stack, link, rest, [each for each in (*tabs, moved) if each.is_open], ports, servers)
    return wrong


def _drained(
    stack: ExitStack,
    link: str,
    rest: list[int],
    tabs: list[Tab],
    ports: list[int],
    servers: list[subprocess.Popen[bytes]],
) -> list[str]:
    """Sends SIGTERM to the server that has one learner. This learner must continue on the other server."""
    (alone,) = (port for port in rest if _sessions(port) == 1)
    server = servers[ports.index(alone)]
    (tab,) = (each for each in tabs if _place_of(each, ports) == ports.index(alone))
    server.send_signal(signal.SIGTERM)
    told = eventually(lambda: any(title == "The lab stops" for title, _ in tab.notices), DRAIN + 1.0)
    closed = _health(alone)["state"] == "stopping"
    began = time.monotonic()
    left = eventually(lambda: server.poll() is not None, DRAIN + 10.0)
    seconds = time.monotonic() - began
    print(f"drained: informed {told}, newcomers refused {closed}, ended {left} after {seconds:.1f} s")
    # The other server is full, so one of its learners makes room.
    other = next(port for port in rest if port != alone)
    next(each for each in tabs if each is not tab and _place_of(each, ports) == ports.index(other)).__exit__()
    _, there = _again(stack, tab, link)
    print(f"drained: the learner continues on another server at the same step: {there}")
    right = {"told": told, "newcomers are refused": closed, "ended": left, "goes on": there}
    return [f"drained: {name}" for name, is_so in right.items() if not is_so]


def _again(stack: ExitStack, tab: Tab, link: str) -> tuple[Tab, bool]:
    """Waits until the server of a tab has ended. Returns the tab on its new server, and whether it shows the
    second step of the lesson."""
    assert eventually(lambda: not tab.is_open, _LONG)
    until = time.monotonic() + _LONG
    while time.monotonic() < until:
        moved = stack.enter_context(opened(link, tab.storage, _LONG))
        eventually(lambda now=moved: now.shows("2 of") or not now.is_open, _LONG)
        if moved.is_open:
            return moved, moved.shows("2 of")
    return tab, False


def _until(condition: Callable[[], bool], page: Page) -> bool:
    """Waits for a condition while the browser keeps running."""
    until = time.monotonic() + _LONG
    while not condition():
        if time.monotonic() > until:
            return False
        page.wait_for_timeout(100)
    return True


def _commands(tab: Tab) -> bool:
    return any(each["hotkey"] == "N" for each in list(tab.commands.values()))


def _step(storage: Storage) -> int:
    kept = "".join(storage.session.values())
    return json.loads(kept).get("step", 0) if kept else 0


def _step_of(page: Page) -> int:
    kept = page.evaluate("() => sessionStorage.getItem('himpc-lab-place')")
    return json.loads(kept).get("step", 0) if kept else 0


def _place_of(tab: Tab, ports: list[int]) -> int:
    """Returns the number of the server with which a tab is connected. nginx gives it in a header of the
    handshake."""
    return ports.index(int(tab.answered("X-Server").rpartition(":")[2]))


def _asked_to_wait(link: str) -> bool:
    try:
        urllib.request.urlopen(
            urllib.request.Request(link.partition("/?")[0], headers={"X-Himpc-Lab-Token": _TOKEN})
        )
    except urllib.error.HTTPError as full:
        return full.code == 503 and full.headers["Refresh"] == "5"
    return False


def _sessions(port: int) -> int:
    return int(_health(port)["sessions"])


def _health(port: int) -> dict[str, str]:
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/health", timeout=30.0) as found:
            return json.loads(found.read())
    except urllib.error.HTTPError as full:
        return json.loads(full.read())


@contextmanager
def _server(port: int, address: int) -> Iterator[subprocess.Popen[bytes]]:
    """Runs a server, and ends it at the end if it still runs."""
    options = f"--no-browser --port {port} --max-sessions {SESSIONS} --one-of-several --drain {DRAIN}"
    more = ["--no-own-files", "--lesson", "one-task", "--trusted-origin", f"http://127.0.0.1:{address}"]
    process = subprocess.Popen(
        [sys.executable, "-m", "app", *options.split(), *more],
        cwd=ROOT,
        env={**os.environ, VARIABLE: _TOKEN},
        stdout=subprocess.DEVNULL,
    )
    try:
        assert eventually(lambda: _answers(port) or process.poll() is not None, _LONG)
        assert process.poll() is None, "a server did not start"
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def _balancer(nginx: str, folder: Path, port: int, ports: list[int]) -> Iterator[None]:
    """Runs nginx with the printed configuration. A header of each response names the server that answered."""
    text = (ROOT / "docs" / "serving.md").read_text()
    (site,) = re.findall(r"```text\n(upstream .*?)```", text, re.DOTALL)
    lines = "".join(f"    server 127.0.0.1:{each} max_fails=0;\n" for each in ports)
    site = re.sub(r"(    server lab-\d\.example\.org.*\n)+", lines, site)
    site = site.replace("listen 80;", f"listen 127.0.0.1:{port};")
    site = site.replace(
        "proxy_pass http://lab;", "proxy_pass http://lab; add_header X-Server $upstream_addr always;"
    )
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    folders = "".join(f"{kind}_temp_path {folder}/{kind};\n" for kind in kinds)
    (folder / "nginx.conf").write_text(
        f"daemon off; pid {folder}/pid; error_log {folder}/error.log;\nevents {{}}\n"
        f"http {{\naccess_log off;\n{folders}{site}}}\n"
    )
    process = subprocess.Popen(
        [nginx, "-c", str(folder / "nginx.conf"), "-e", str(folder / "start.log")], stderr=subprocess.DEVNULL
    )
    try:
        assert eventually(lambda: _answers(port), _LONG)
        yield
    finally:
        process.terminate()
        process.wait()


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


if __name__ == "__main__":
    sys.exit(main())
