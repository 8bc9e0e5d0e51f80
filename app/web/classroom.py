"""The classroom: all pages show one session, and only pages with the instructor's token control it."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Sequence
from typing import ClassVar, cast

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.process import Spares
from app.web.sessions import WORKER, Refuse

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
    *("ready", "status", "settings", "failure", "changed", "tape", "score", "record", "choice", "lecture"),
    *(
        "ghost",
        "pid",
        "quiet",
        "trouble",
        "settings_of",
        "choice_of",
        "lecture_of",
        "read",
        "look",
        "ask",
        "code",
        "compiles",
    ),
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
        """Ends the simulation process."""
        self._learner.close()
        self._spares.close()
