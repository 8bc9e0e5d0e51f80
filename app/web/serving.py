"""Serves the page until a signal arrives, for `himpc-lab` without a command."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from app.classes.words import ONLY_HERE
from app.link.threads import on_thread
from app.web.server import PageServer, seen_from_outside
from app.web.sessions import Classroom

if TYPE_CHECKING:
    from app.web.server import PageServer

_WIDTH = 22
_INSTRUCTOR = "instructor's token:"


def greeting(server: PageServer) -> Iterator[str]:
    """Yields one line for a user who works alone; otherwise a list of addresses, each with the people who
    should use it."""
    yield f"himpc-lab ready at {server.link}"
    shared = server.public or server.hall is not None or _has_an_instructor(server)
    if shared:
        yield from _for_others(server)
    if server.hall is not None:
        yield f"  {'teacher:':{_WIDTH}}{server.teachers_link}"
        yield f"  {'phones:':{_WIDTH}}{server.outside}/v/{server.hall.code}"
        if not server.public:
            yield f"  {'':{_WIDTH}}{ONLY_HERE}"
    if server.continued is not None:
        yield f"  {'continues:':{_WIDTH}}{_CONTINUES.format(len(server.continued.state.members))}"
    if server.passes.token is None:
        yield "  --no-token: " + (_ALL if server.public else _ALL_HERE)
    if shared and server.passes.owner is not None:
        yield "  " + _KEEP


def _has_an_instructor(server: PageServer) -> bool:
    return isinstance(server.sessions, Classroom) and not server.sessions.all_steer


def _for_others(server: PageServer) -> Iterator[str]:
    here = seen_from_outside(server.host, server.url)  # in numbers: few networks resolve a laptop's name
    by_proxy = [("through the proxy:", each) for each in server.proxies]
    for what, address in by_proxy if server.proxy_only else (("for others:", here), *by_proxy):
        link = address if server.proxy_only else server.passes.link(address, "guest")
        yield f"  {what:{_WIDTH}}{link}"
    if isinstance(server.sessions, Classroom) and not server.sessions.all_steer:
        yield f"  {_INSTRUCTOR:{_WIDTH}}{server.sessions.token}"


_CONTINUES = (
    "the class of the last start, with {} people; Ctrl-C ends it, and the next start begins a new class"
)
_KEEP = "Keep the first address secret: its page can run your Python files (not with --no-own-files)."
_ALL = "everybody who can reach this address can open the page, run simulations here and upload robots."
_ALL_HERE = "every user of this machine can open the page, run simulations as you and upload robots."


_LEADING = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
    '<meta http-equiv="refresh" content="0; url={0}"><title>himpc-lab</title>'
    '<p><a href="{0}">Open himpc-lab</a></p></html>'
)


@contextlib.contextmanager
def opened_in_a_browser(link: str) -> Iterator[None]:
    """Opens the link in a browser. Every user of the machine can see the arguments of a program, but the link
    is secret. The browser therefore first loads a temporary file that leads to the link. Only this user may
    read the file, and it is deleted afterwards."""
    with tempfile.TemporaryDirectory(prefix="himpc-lab-", ignore_cleanup_errors=True) as folder:  # mode 0700
        file = Path(folder) / "open.html"
        with open(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w", encoding="utf-8") as text:
            text.write(_LEADING.format(escape(link)))
        on_thread("browser", webbrowser.open, file.as_uri())
        yield


def serve(server: PageServer, *, open_browser: bool = True, drain: float = 0.0) -> int:
    """Serves the pages of a server until Ctrl-C or SIGTERM. Then closes the server.

    Args:
        server: the server, which was just started.
        open_browser: whether to open the first page in a browser.
        drain: time, s, for which open pages continue after SIGTERM.
    """
    stop, now, by_hand = threading.Event(), threading.Event(), threading.Event()
    try:
        with _ended_by_signals(stop, now, by_hand), contextlib.ExitStack() as until_the_end:
            for line in greeting(server):
                print(line, flush=True)
            if open_browser:
                until_the_end.enter_context(opened_in_a_browser(server.first_link))
            while not stop.wait(0.5):
                pass
            server.drain(drain, now)
            if by_hand.is_set():
                server.end_class()
    finally:
        server.close()
    if server.loading:
        # A module that is only partly imported could make the interpreter fail when it exits.
        sys.stdout.flush()
        os._exit(0)
    return 0


@contextlib.contextmanager
def _ended_by_signals(
    stop: threading.Event, now: threading.Event, by_hand: threading.Event
) -> Iterator[None]:
    """Within this context, Ctrl-C and SIGTERM set `stop`. Ctrl-C and every further signal also set `now`, and
    Ctrl-C sets `by_hand`. The previous signal handlers are restored afterwards."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _: object) -> None:
        if number == signal.SIGINT:
            by_hand.set()
        if number == signal.SIGINT or stop.is_set():
            now.set()
        stop.set()

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, end) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
