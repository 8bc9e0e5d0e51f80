"""Serves the page until a signal arrives, for `himpc-lab` without a command."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence

from app.link.choice import SceneChoice
from app.server.classroom import Classroom
from app.server.door import as_origin
from app.server.greeting import greeting
from app.server.opening import opened_in_a_browser
from app.server.server import FIRST, PageServer
from lessons.own.folder import Folder


def serve(
    choice: SceneChoice = FIRST,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    max_sessions: int = 4,
    classroom: bool = False,
    open_browser: bool = True,
    trusted_origins: Sequence[str] = (),
    ask_token: bool = True,
    own_files: Folder | None = None,
    key: bytes | None = None,
    token: str | None = None,
    refers: bool = False,
    class_names: bool | None = None,
    proxy_only: bool = False,
    drain: float = 0.0,
    embed_in: Sequence[str] = (),
    class_key: str | None = None,
    class_of: str | None = None,
    room: Classroom | None = None,
    over: Callable[[], bool] = lambda: False,
) -> int:
    """Serves the page until Ctrl-C, SIGTERM, or until `over` returns True. Raises InputError for a scene,
    robot, host, port or origin that cannot be used.

    With `classroom` all pages show one session, and pages on which the printed token was typed control it.
    The page asks for a token unless `ask_token` is False. The page whose address contains the owner's
    secret may open and run files below `own_files` by path; with None no page may. `key` signs the
    learners' progress. `token` replaces the random one; with `refers` a full server answers 503, so that a
    proxy tries the next one. `class_names`: whether a class is asked for names; None: there is no class.
    `class_of` is the server of a class that this one follows; both have the same `class_key`.
    With `proxy_only` only a proxy that sends the token in its header is let in. After SIGTERM the pages that
    are open have `drain` seconds. Pages of the origins `embed_in` may show the page in a frame. With `room`
    all pages show the robot of that room.
    """
    server = PageServer(
        choice,
        host,
        port,
        max_sessions,
        classroom=classroom,
        trusted_origins=trusted_origins,
        ask_token=ask_token,
        own_files=own_files,
        key=key,
        token=token,
        refers=refers,
        class_names=class_names,
        proxy_only=proxy_only,
        embed_in=embed_in,
        class_key=class_key,
        class_of=class_of,
        room=room,
    )
    stop, now = threading.Event(), threading.Event()
    try:
        with _ended_by_signals(stop, now), contextlib.ExitStack() as until_the_end:
            for line in greeting(server, host, tuple(map(as_origin, trusted_origins))):
                print(line, flush=True)
            if open_browser:
                until_the_end.enter_context(opened_in_a_browser(server.first_link))
            while not stop.wait(0.5) and not over():
                pass
            server.drain(drain, now)
    finally:
        server.close()
    if server.loading:
        # A module that is only partly imported could make the interpreter fail when it exits.
        sys.stdout.flush()
        os._exit(0)
    return 0


@contextlib.contextmanager
def _ended_by_signals(stop: threading.Event, now: threading.Event) -> Iterator[None]:
    """Lets Ctrl-C and SIGTERM set `stop`, and Ctrl-C and every further signal also `now`; the previous signal
    handlers are restored afterwards."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _: object) -> None:
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
