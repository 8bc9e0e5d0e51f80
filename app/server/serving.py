"""Serves the page until a signal arrives, for `himpc-lab` without a command."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator

from app.server.greeting import greeting
from app.server.opening import opened_in_a_browser
from app.server.server import PageServer


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
