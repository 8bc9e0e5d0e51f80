"""One learner: a simulation process and perhaps its ghost. Outlives page reloads."""

from __future__ import annotations

import time
from dataclasses import replace
from queue import Empty, Queue

from app.client.ghost import Ghost
from app.client.simulation import Simulation
from app.link.choice import SceneChoice
from app.link.exercise import Lecture
from app.link.messages import Lead, Leash, Load, Ready, Report, ResetAll, Script, Status, Tell, Told
from app.link.process import Process, Spares
from lessons.teaching import lesson


class Learner(Simulation):
    """The simulation of one browser tab, and the ghost that follows it, if there is one."""

    def __init__(self, token: str, choice: SceneChoice, spares: Spares) -> None:
        self.token = token
        self.choice = choice
        self.attached = False
        self.left_at = time.monotonic()
        self.ghost: Ghost | None = None
        self.lecture: Lecture | None = None
        self._asking: Queue[Told] | None = None
        super().__init__(spares)

    def _start(self) -> None:
        super()._start()
        self.send(Load(self.choice))
        if self.ghost is not None:
            self.send(Lead(True))

    def reset_all(self) -> None:
        """The scene from its beginning; after a crash in a new process."""
        if self.failure is None:
            self.send(ResetAll())
        else:
            self.restart()

    def restart(self) -> None:
        """A new process for the same scene."""
        with self._lock:
            if self._closed:
                return
            before = self._process
            self.failure = None
            self._start()
        before.close()

    def _enter(self, ready: Ready) -> None:
        super()._enter(ready)
        self.choice, self.lecture = ready.choice, None

    def choice_of(self, ready: Ready) -> SceneChoice:
        """What was chosen, as `settings_of`: perhaps a later step of the lesson than the one it came with."""
        with self._lock:
            return self.choice if self.ready is ready else ready.choice

    def _hear(self, process: Process, report: Report) -> None:
        super()._hear(process, report)
        if isinstance(report, Status) and report.lecture is not None and process is self._process:
            self.lecture = report.lecture
            self.choice = replace(SceneChoice.of_lesson(self.lecture.exercise), seed=self.choice.seed)
        if isinstance(report, Told) and self._asking is not None:
            self._asking.put(report)
        ghost = self.ghost
        if isinstance(report, Script) and ghost is not None and process is self._process:
            ghost.hear(report)

    def ask(self, timeout: float = 10.0) -> Told | None:
        """What the run was; None if the simulation does not answer within so many seconds. Not to be called
        on the page's loop or viser's: it waits."""
        answer: Queue[Told] = Queue()
        self._asking = answer
        self.send(Tell())
        try:
            return answer.get(timeout=timeout)
        except Empty:
            return None

    # ---------------------------------------------------------------- ghost

    def start_ghost(self, ghost: lesson.Ghost) -> None:
        """A second robot, with `ghost.set` on top of whatever is set here, in the same scene: the scene
        starts again so that both begin together. A ghost that is there already becomes the new one. If
        `ghost.set` does not fit the scene, a notice says so and there is no ghost."""
        with self._lock:
            if self._closed:
                return
            before = self.ghost
            self.ghost = Ghost(
                ghost.words,
                ghost.set,
                self._spares,
                lambda until: self.send(Leash(until)),
                self._lost_ghost,
            )
        if before is not None:
            before.close()
        self.send(Lead(True))

    def stop_ghost(self) -> None:
        """The robot goes on alone."""
        with self._lock:
            before, self.ghost = self.ghost, None
        self.send(Lead(False))
        if before is not None:
            before.close()

    def _lost_ghost(self, ghost: Ghost, sentence: str) -> None:
        with self._lock:
            if ghost is not self.ghost:
                return
            self._notices.append(f"There is no ghost: {sentence}")
        self.stop_ghost()

    def close(self) -> None:
        super().close()
        ghost, self.ghost = self.ghost, None
        if ghost is not None:
            ghost.close()
