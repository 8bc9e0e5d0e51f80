"""The run of a step's second robot, computed headless while the learner reads. Claims are compared with this
run."""

from __future__ import annotations

from time import perf_counter

from app.link.exercise import LessonPlace
from app.worker.lesson.rows import LessonRows
from lessons.scenes.scene import Scene
from lessons.session.start import begin
from lessons.teaching.lesson import Step


class GhostRun:
    """A run that is computed in small pieces, until `finished` is true."""

    def __init__(self, scene: Scene, seed: int) -> None:
        self._session = begin(scene, seed)
        self._ticks = max(1, round(scene.duration / self._session.settings.T_s))
        self.record = LessonRows(self._session.layout, self._ticks)

    @property
    def finished(self) -> bool:
        session = self._session
        return len(self.record) >= self._ticks or session.diverged_at is not None or session.over

    def work(self, seconds: float) -> None:
        """Continues the run for about this wall time."""
        until = perf_counter() + seconds
        while not self.finished and perf_counter() < until:
            self.record.add(self._session.tick())


def ghost_of(exercise: LessonPlace, seed: int) -> GhostRun | None:
    """Returns the second robot's run if a claim or a prediction is compared with it; else None."""
    step = exercise.part
    if not isinstance(step, Step) or step.ghost is None:
        return None
    return GhostRun(exercise.run.but(*step.ghost.set).prepared(), seed)
