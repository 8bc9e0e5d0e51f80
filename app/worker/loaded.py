"""A scene that is about to be run."""

from __future__ import annotations

from dataclasses import dataclass

from app.link.choice import SceneChoice
from app.link.messages import Post
from app.worker.lesson.lecturer import Lecturer
from app.worker.reports.start import Run
from lessons.scenes.scene import Scene
from lessons.session.session import Session


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scene at its beginning, once nothing of it can be refused any more. mine: a learner's changes."""

    choice: SceneChoice
    scene: Scene
    run: Run
    lecturer: Lecturer | None
    mine: tuple[Post, ...]

    def looks_like(self, choice: SceneChoice, session: Session) -> bool:
        """Whether it is another step of the lesson that runs: as long as it looks the same, nothing needs to
        be built anew."""
        then, now = choice.exercise, self.choice.exercise
        if then is None or now is None or then.lesson != now.lesson:
            return False
        return self.run.session.layout == session.layout
