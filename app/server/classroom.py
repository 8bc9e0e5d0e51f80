"""The classroom: all pages show one session, and only pages with the instructor's token control it."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeVar, cast

from app.client.decimated import History
from app.client.ghost import GhostClient
from app.client.pose_history import PoseHistory
from app.client.rows import RowHistory
from app.client.run_statistics import RunStatistics
from app.client.simulation_client import SimulationClient
from app.client.trouble import Trouble
from app.link.choice import SceneChoice
from app.link.exercise import Lecture
from app.link.messages import Command, Ready, Status, Told
from app.link.ring import Block
from app.link.spares import Spares
from app.server.sessions import WORKER, Refuse

if TYPE_CHECKING:
    from lessons.settings.settings import SceneSettings
    from lessons.teaching import lesson

STEERING = "The instructor steers: this page only watches."
T = TypeVar("T")


class Watcher:
    """The view of the session for a page that only watches. It offers everything that pages use of a
    `SimulationClient`; commands have no effect and are refused."""

    token = ""
    attached = True

    def __init__(self, shown: SimulationClient, refuse: Refuse) -> None:
        """refuse: shows a sentence on the page that says why a command was refused."""
        self._shown = shown
        self._refuse = refuse

    @property
    def ready(self) -> Ready | None:
        return self._shown.ready

    @property
    def status(self) -> Status | None:
        return self._shown.status

    @property
    def settings(self) -> SceneSettings | None:
        return self._shown.settings

    @property
    def failure(self) -> str | None:
        return self._shown.failure

    @property
    def changed(self) -> int:
        return self._shown.changed

    @property
    def tape(self) -> PoseHistory:
        return self._shown.tape

    @property
    def score(self) -> RunStatistics | None:
        return self._shown.score

    @property
    def record(self) -> RowHistory | None:
        return self._shown.record

    @property
    def choice(self) -> SceneChoice:
        return self._shown.choice

    @property
    def lecture(self) -> Lecture | None:
        return self._shown.lecture

    @property
    def ghost(self) -> GhostClient | None:
        return self._shown.ghost

    @property
    def pid(self) -> int | None:
        return self._shown.pid

    @property
    def quiet(self) -> float:
        return self._shown.quiet

    def trouble(self) -> Trouble | None:
        return self._shown.trouble()

    def settings_of(self, ready: Ready) -> SceneSettings:
        return self._shown.settings_of(ready)

    def choice_of(self, ready: Ready) -> SceneChoice:
        return self._shown.choice_of(ready)

    def lecture_of(self, ready: Ready) -> Lecture | None:
        return self._shown.lecture_of(ready)

    def read(self, look: Callable[[Block, History], T]) -> T | None:
        return self._shown.read(look)

    def look(self, rows: bool = True) -> float | None:
        return self._shown.look(rows)

    def ask(self, timeout: float = 10.0) -> Told | None:
        return self._shown.ask(timeout)

    def take_messages(self) -> tuple[list[str], list[str]]:
        """Returns no messages: they answer the instructor's commands."""
        return [], []

    def send(self, command: Command) -> None:
        self._refuse(STEERING)

    def start_ghost(self, ghost: lesson.Ghost) -> None:
        self._refuse(STEERING)

    def stop_ghost(self) -> None:
        self._refuse(STEERING)

    def reset_all(self) -> None:
        self._refuse(STEERING)

    def load(self, choice: SceneChoice) -> None:
        self._refuse(STEERING)

    def restart(self, choice: SceneChoice | None = None) -> None:
        self._refuse(STEERING)


class Classroom:
    """Replaces `Sessions` in a classroom: every visitor is admitted, and the session lasts as long as the
    server."""

    def __init__(self, choice: SceneChoice) -> None:
        self.token = secrets.token_urlsafe(16)
        self.max_sessions = 1
        self._spares = Spares(WORKER)
        self._learner = SimulationClient(self.token, choice, self._spares)

    @property
    def learners(self) -> tuple[SimulationClient, ...]:
        return (self._learner,)

    def is_right(self, token: str) -> bool:
        """Whether this is the instructor's token, compared in constant time."""
        return secrets.compare_digest(token.encode(errors="replace"), self.token.encode())

    def enter(self, tokens: Sequence[str], refuse: Refuse) -> SimulationClient:
        """Returns the session itself to a visitor with the token, otherwise a `Watcher`."""
        if any(map(self.is_right, tokens)):
            return self._learner
        return cast(SimulationClient, Watcher(self._learner, refuse))

    def leave(self, learner: SimulationClient) -> None:
        """Called when a page was closed; the session continues."""

    def close(self) -> None:
        """Ends the simulation process."""
        self._learner.close()
        self._spares.close()
