"""One learner: a simulation process and what is known about it. Outlives page reloads."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TypeVar

from app.block import Block
from app.history import BUCKETS, History
from app.messages import Command, Failed, Load, Ready, Refused, Report, ResetAll, SceneChoice, Status
from app.process import Process, Spares
from himpc.telemetry import Layout
from lessons.kinds import AnySettings

WINDOW = 8.0  # s of simulated time in the plots
T = TypeVar("T")


class Learner:
    """Owns the process of one browser tab. Reports arrive on the process' thread; the page reads the fields
    from its own loop. `changed` counts scenes and restarts: the page rebuilds itself when it differs."""

    def __init__(self, token: str, choice: SceneChoice, spares: Spares) -> None:
        self.token = token
        self.choice = choice
        self.attached = False
        self.left_at = time.monotonic()
        self.ready: Ready | None = None
        self.status: Status | None = None
        self.settings: AnySettings | None = None
        self.failure: str | None = None
        self.changed = 0
        self._refusals: list[str] = []
        self._notices: list[str] = []
        self._spares = spares
        self._lock = threading.RLock()
        self._block: Block | None = None
        self._history: History | None = None
        self._closed = False
        self._start()

    def _start(self) -> None:
        process = self._process = self._spares.take()
        process.listen(lambda report: self._hear(process, report))
        process.send(Load(self.choice))

    @property
    def pid(self) -> int | None:
        return self._process.pid

    def send(self, command: Command) -> None:
        self._process.send(command)

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

    # ---------------------------------------------------------------- reports

    def _hear(self, process: Process, report: Report) -> None:
        with self._lock:
            if self._closed or process is not self._process:
                return
            match report:
                case Ready():
                    self._enter(report)
                case Status():
                    self.status = report
                    self.settings = report.settings or self.settings
                    self._notices += report.notices
                case Refused(sentence):
                    self._refusals.append(sentence)
                case Failed(sentence):
                    self.failure = sentence

    def _enter(self, ready: Ready) -> None:
        self._free()
        self.ready, self.choice = ready, ready.choice
        self.settings, self.status = ready.settings, None
        self._block = Block.for_robot(ready.robot, ready.layout.size, ready.block)
        self._history = _history(self._block, ready.layout, ready.settings.T_s)
        self.changed += 1

    def _free(self) -> None:
        block, self._block, self._history = self._block, None, None
        if block is not None:
            block.close(unlink=True)

    def take_messages(self) -> tuple[list[str], list[str]]:
        """(refusals, notices) since the last call."""
        with self._lock:
            refusals, self._refusals = self._refusals, []
            notices, self._notices = self._notices, []
            return refusals, notices

    # ---------------------------------------------------------------- telemetry

    def read(self, look: Callable[[Block, History], T]) -> T | None:
        """What `look` finds, while the memory cannot be freed under it; None before the first scene."""
        with self._lock:
            if self._block is None or self._history is None:
                return None
            return look(self._block, self._history)

    def new_time_step(self, T_s: float) -> None:
        """Thins the plots anew after T_s changed."""
        with self._lock:
            if self._block is not None and self._history is not None:
                self._history = _history(self._block, self._history.layout, T_s)

    def close(self) -> None:
        with self._lock:
            self._closed = True
        self._process.close()
        with self._lock:
            self._free()


def _history(block: Block, layout: Layout, T_s: float) -> History:
    return History(block, layout, round(WINDOW / T_s / BUCKETS))
