"""Runs a hostile user (`benchmarks.hostile`) against a server, and checks the server and the page."""

from __future__ import annotations

import time
from collections.abc import Callable

from app.web.server import PageServer
from benchmarks.findings import Findings
from benchmarks.hostile import HostileUser
from browsing.wire import Wire, eventually


def roam(server: PageServer, seconds: float, seed: int, complaints: Callable[[], str]) -> Findings:
    """Runs a hostile user for a time, with each action at least once; it ends early after a fault.

    complaints: everything that was written to standard error so far.
    """
    found = Findings(seed)
    user = HostileUser(server.link, seed)
    try:
        if not eventually(lambda: user.page.shows("t = ")):
            found.blame("the page does not begin")
        end = time.monotonic() + seconds
        while (time.monotonic() < end or not user.once_all) and not found.faults:
            user.act()
            _look(server, user.page, found, complaints)
        if not found.faults and not _answers(server, user):
            found.blame("the page does not answer any more")
        _look(server, user.page, found, complaints)
    finally:
        user.close()
    found.actions = user.actions
    return found


def _look(server: PageServer, page: Wire, found: Findings, complaints: Callable[[], str]) -> None:
    """Adds a fault for every message on the terminal, every closed page and every failed simulation."""
    said = complaints()
    for word in ("Traceback", "Exception", "Warning", "[viser]"):
        if word in said:
            found.blame("on the terminal: " + said[max(0, said.index(word) - 200) :][:2500])
            return
    if page.shows("cannot be shown"):
        found.blame("the page ended")
    for learner in server.sessions.learners:
        if learner.failure is not None:
            found.blame(f"the simulation: {learner.failure}")
        if learner.ready is not None:
            found.scenes.add(learner.choice.run.scene)


def _answers(server: PageServer, user: HostileUser) -> bool:
    """Returns whether a new page shows the session and accepts a command."""
    user.reload()
    if not eventually(lambda: user.page.find("Playback") is not None and bool(server.sessions.learners)):
        return False
    learner = server.sessions.learners[-1]

    def stepped() -> bool:
        before = -1 if learner.status is None else learner.status.ticks
        button = user.page.find("Playback")
        if button is not None:
            user.page.write(button, value="Step")
        return eventually(lambda: learner.status is not None and learner.status.ticks != before, 2.0)

    return eventually(stepped)
