"""One session for everybody: all pages show it, and who has the instructor's token steers it."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Sequence
from typing import Any, cast

from app.client.learner import Learner
from app.link.choice import SceneChoice
from app.link.messages import Command
from app.link.spares import Spares
from app.server.sessions import WORKER
from lessons.teaching import lesson

STEERING = "The instructor steers: this page only watches."


class Watcher:
    """A learner as a page sees it that only watches: everything can be looked at, nothing changes it."""

    def __init__(self, shown: Learner) -> None:
        self.token = ""
        self.on_refusal: Callable[[str], object] = lambda _: None
        self._shown = shown

    def __getattr__(self, name: str) -> Any:
        return getattr(self._shown, name)

    def send(self, command: Command) -> None:
        self.on_refusal(STEERING)

    def start_ghost(self, ghost: lesson.Ghost) -> None:
        self.on_refusal(STEERING)

    def stop_ghost(self) -> None:
        self.on_refusal(STEERING)

    def reset_all(self) -> None:
        self.on_refusal(STEERING)

    def restart(self, choice: SceneChoice | None = None) -> None:
        self.on_refusal(STEERING)

    def load(self, choice: SceneChoice) -> None:
        self.on_refusal(STEERING)

    def take_messages(self) -> tuple[list[str], list[str]]:
        """None: they answer what the instructor did."""
        return [], []


class Classroom:
    """In place of `Sessions`: nobody is turned away, and the session lasts as long as the server."""

    def __init__(self, choice: SceneChoice) -> None:
        self.token = secrets.token_hex(4)
        self.max_sessions = 1
        self._spares = Spares(WORKER)
        self._learner = Learner(self.token, choice, self._spares)

    @property
    def learners(self) -> tuple[Learner, ...]:
        return (self._learner,)

    def enter(self, tokens: Sequence[str]) -> Learner:
        """The session itself for who has the token, else a view of it."""
        if self.token in tokens:
            return self._learner
        return cast(Learner, Watcher(self._learner))

    def leave(self, learner: Learner) -> None:
        """A page was closed: nothing changes."""

    def close(self) -> None:
        """Ends the process."""
        self._learner.close()
        self._spares.close()
