"""The simulations of a server. Each tab has a learner of its own, which gets its place back after a reload
and is removed some seconds after the tab was closed. In a classroom all pages show one session, and only
pages with the instructor's token control it."""

from __future__ import annotations

import contextlib
import gc
import json
import secrets
import threading
import time
from collections.abc import Callable, Sequence
from typing import ClassVar, cast

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.process import Spares
from app.link.threads import on_thread
from app.web.malloc_tuning import give_back

WORKER = "app.worker.entry"
"""The name of the module that a simulation process runs. The server never imports this module."""
Refuse = Callable[[str], object]
"""Shows a sentence on the page whose command is not allowed."""

GRACE = 10.0  # s for which a session continues after its tab was closed: enough for a reload
_PERIOD = 0.5  # s between two checks for learners who have left
_TIDY = 10.0
"""Shortest time, s, after which free memory is returned to the system again, if scenes were changed."""


class Sessions:
    """At most `max_sessions` learners, and one spare process as long as there is room for another learner."""

    turns_away: ClassVar[bool] = True

    def __init__(self, choice: SceneChoice, max_sessions: int, grace: float = GRACE) -> None:
        self.max_sessions = max_sessions
        self.start = choice
        self._grace = grace
        self._spares = Spares(WORKER)
        self._lock = threading.Lock()
        self._learners: dict[str, SimulationClient] = {}
        self._guide: SimulationClient | None = None
        self._closed = threading.Event()
        self._spares.refill()
        self._keeper = on_thread("sessions", self._keep_on_thread)

    @property
    def learners(self) -> tuple[SimulationClient, ...]:
        with self._lock:
            return tuple(self._learners.values())

    def guide(self) -> SimulationClient:
        """Returns the robot of a teacher. It uses no learner's place and lasts as long as the server."""
        with self._lock:
            if self._guide is None:
                self._guide = SimulationClient(secrets.token_urlsafe(16), self.start, self._spares)
            return self._guide

    def enter(
        self, tokens: Sequence[str], refuse: Refuse | None = None, account: str = ""
    ) -> SimulationClient | None:
        """Returns the learner that this browser left, or a new learner; None if all places are taken. A place
        that was left a moment ago is reserved for the browser that has its token. tokens: the tokens of the
        browser, latest last; account: the account with which the user signed in; a browser gets only learners
        of this account."""
        with self._lock:
            if self._closed.is_set():
                return None
            for token in reversed(tokens):
                known = self._learners.get(token)
                if known is not None and not known.attached and known.account == account:
                    known.attached = True
                    return known
            if len(self._learners) >= self.max_sessions:
                return None
            learner = SimulationClient(secrets.token_urlsafe(16), self.start, self._spares)
            learner.attached, learner.account = True, account
            self._learners[learner.token] = learner
        return learner

    def leave(self, learner: SimulationClient) -> None:
        """Called when a tab was closed or reloaded."""
        learner.left_at = time.monotonic()
        learner.attached = False

    def _keep_on_thread(self) -> None:
        tidied, scenes = time.monotonic(), 0
        while not self._closed.wait(_PERIOD):
            now = time.monotonic()
            with self._lock:
                ended = [
                    learner
                    for learner in self._learners.values()
                    if not learner.attached and now - learner.left_at > self._grace
                ]
                for learner in ended:
                    del self._learners[learner.token]
                room = len(self._learners) < self.max_sessions
            for learner in ended:
                learner.close()
            if ended and not self.learners:  # the last page has gone: its recordings need not stay in memory
                gc.collect()
                give_back()
            changed = sum(learner.changed for learner in self.learners)
            if changed != scenes and now - tidied > _TIDY:
                tidied, scenes = now, changed
                give_back()
            if room:
                with contextlib.suppress(OSError, RuntimeError):  # a limit of the system is reached
                    self._spares.refill()

    def close(self) -> None:
        self._closed.set()
        self._keeper.join()
        with self._lock:
            learners, self._learners = list(self._learners.values()), {}
            if self._guide is not None:
                learners.append(self._guide)
        for thread in [on_thread("ending", learner.close) for learner in learners]:
            thread.join()
        self._spares.close()


def tokens_of(stored: str | None) -> list[str]:
    """Reads tokens from the browser's storage, whose content is not trusted."""
    try:
        found = json.loads(stored or "[]")
    except (ValueError, RecursionError):
        return []
    return [token for token in found if isinstance(token, str)][-8:] if isinstance(found, list) else []


STEERING = "Only the instructor can control the robot: enter the instructor's token on this page first."


class Watcher:
    """The view of the session for a page that only watches. It has all members of a `SimulationClient` that
    pages use. Commands are refused and have no effect."""

    token = ""
    attached = True
    shows_ghosts = False

    def __init__(self, shown: SimulationClient, refuse: Refuse) -> None:
        """refuse: shows a sentence on the page: the reason why a command was refused."""
        self._shown = shown
        self._refuse = refuse

    def take_messages(self) -> tuple[list[str], list[str]]:
        """Returns no messages, as the session's messages answer the instructor's commands."""
        return [], []


def _of_the_session(name: str) -> property:
    return property(lambda self: getattr(self._shown, name))


for _name in (
    *("ready", "status", "settings", "failure", "changed", "figures", "choice", "lecture"),
    *("ghost", "pid", "quiet", "trouble", "settings_of", "choice_of", "lecture_of", "read", "look", "ask"),
    *("code", "compiles"),
):
    setattr(Watcher, _name, _of_the_session(_name))
for _name in ("send", "start_ghost", "stop_ghost", "reset_all", "load", "restart"):
    setattr(Watcher, _name, property(lambda self: lambda *_, **__: self._refuse(STEERING)))


class Classroom:
    """Replaces `Sessions` in a classroom: every visitor is admitted, and the session lasts as long as the
    server."""

    turns_away: ClassVar[bool] = False

    def __init__(self, choice: SceneChoice, all_steer: bool = False) -> None:
        """all_steer: whether every page controls the robot, without the token."""
        self.all_steer = all_steer
        self.token = secrets.token_urlsafe(16)
        self.max_sessions = 1
        self._lock, self._pages = threading.Lock(), 0
        self._spares = Spares(WORKER)
        self._learner = SimulationClient(self.token, choice, self._spares)

    @property
    def learners(self) -> tuple[SimulationClient, ...]:
        return (self._learner,)

    def guide(self) -> SimulationClient:
        """Returns the session itself, which the teacher controls."""
        return self._learner

    def is_right(self, token: str) -> bool:
        """Returns whether this is the instructor's token, compared in constant time."""
        return secrets.compare_digest(token.encode(errors="replace"), self.token.encode())

    def enter(self, tokens: Sequence[str], refuse: Refuse, account: str = "") -> SimulationClient:
        """Returns the session itself to a visitor with the token, otherwise a `Watcher`."""
        with self._lock:
            self._pages += 1
            self._learner.attached = True
        if self.all_steer or any(map(self.is_right, tokens)):
            return self._learner
        return cast(SimulationClient, Watcher(self._learner, refuse))

    def leave(self, learner: SimulationClient) -> None:
        """Called when a page was closed. The session continues."""
        with self._lock:
            self._pages -= 1
            self._learner.attached = self._pages > 0

    @property
    def pages(self) -> int:
        """The number of open pages."""
        with self._lock:
            return self._pages

    def close(self) -> None:
        self._learner.close()
        self._spares.close()
