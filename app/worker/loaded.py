"""A scene that was loaded and is about to run."""

from __future__ import annotations

from dataclasses import dataclass

from app.link.choice import SceneChoice
from app.link.messages import Post
from app.worker.lesson.lecturer import Lecturer
from app.worker.reports.start import SessionReport, start
from lessons.events import Set
from lessons.scenes.scene import Scene
from lessons.session.session import Session
from lessons.settings.assignments import parse_assignment
from lessons.settings.settings import SceneSettings


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scene at its start, which has passed all checks. mine: the learner's changes; before: the settings of
    the scene before any assignment, None if they are not known; left_out: for each task of a file that is not
    offered, the reason."""

    choice: SceneChoice
    scene: Scene
    run: SessionReport
    lecturer: Lecturer | None
    mine: tuple[Post, ...]
    before: SceneSettings | None = None
    left_out: tuple[str, ...] = ()

    def looks_like(self, choice: SceneChoice, session: Session) -> bool:
        """Returns whether this is a step of the running lesson and looks the same. The page need not be
        rebuilt then."""
        then, now = choice.exercise, self.choice.exercise
        if then is None or now is None or then.lesson != now.lesson:
            return False
        return self.run.session.layout == session.layout


def loaded_from(choice: SceneChoice, scene: Scene | None, judged: bool) -> Loaded:
    """Loads a scene. scene: replaces the scene of the choice; judged: whether the claims are judged, if the
    choice is a step of a lesson. Raises InputError for a scene or robot that cannot be loaded."""
    left_out: tuple[str, ...] = ()
    before = None
    if scene is None:
        choice, scene, before, left_out = choice.fitted()
    run = start(scene, choice.run.seed)
    mine = tuple(Post(Set(*parse_assignment(each))) for each in choice.mine)
    step = choice.exercise if judged else None
    lecturer = None if step is None else Lecturer(step, run.session, choice.run.seed)
    return Loaded(choice.resolved(), scene, run, lecturer, mine, before, left_out)
