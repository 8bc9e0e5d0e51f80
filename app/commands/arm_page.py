"""`himpc-lab arm --page`: the page of an arm, and the process that watches the arm for it."""

from __future__ import annotations

import signal
import socket
import sys
from collections.abc import Callable

from app.arm.drive import Drive, Driven, drive, hurry
from app.arm.model import Model
from app.arm.prepared import Prepared
from app.arm.shown import Shown
from app.link.children import Spawned, forked_here
from app.link.choice import SceneChoice
from app.link.process import Process
from app.link.wire import Wire
from app.server.classroom import Classroom
from app.server.server import PageServer
from app.server.serving import serve

_PRIORITY = 10
"""Real-time priority, below the loop's. A watcher without real-time priority may get a core too late and
count as silent."""


def drive_on_a_page(
    choice: SceneChoice,
    ready: Prepared,
    plan: Drive,
    model: Model,
    finish: Callable[[Driven], int],
    port: int,
    open_browser: bool,
) -> int:
    """Serves the page of an arm until it is closed, and returns the exit code.

    Args:
        choice: the run that the page shows.
        ready, plan, model: the data of the drive, which begins when Run is pressed on the page.
        finish: prints the reason of the drive's end, writes its files and returns the exit code.
        port: the port on which the server listens.
        open_browser: whether to open the page in a browser of this machine.
    """

    def watch(wire: Wire) -> None:
        hurry(_PRIORITY)
        shown = Shown(wire, choice, ready, plan.period)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: shown.interrupt())
        code = 0
        if shown.wait_for_start():
            driven = drive(plan, model, lambda text: print(text, flush=True), shown)
            shown.stay(driven)
            code = finish(driven)
        sys.exit(code)

    watching: list[Spawned] = []

    def start(theirs: socket.socket) -> Spawned:
        watching.append(forked_here(watch, theirs))
        return watching[-1]

    room = Classroom(choice, all_steer=True, arm=Process(start))
    try:
        server = PageServer(choice, port=port, room=room)
        serve(server, open_browser=open_browser, over=lambda: room.deserted)
    except BaseException:
        room.close()
        raise
    return watching[-1].exitcode or 0
