"""The page's handle of a simulation process, with the data that the process has reported."""

from __future__ import annotations

import os
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeVar

from app.client.recording import Recording, RunFigures
from app.link.fork_server import FIRST_PATIENCE
from app.link.messages import Command, Loading, LoadRefused, Ready, Report, SimulationFailed, Status
from app.link.process import Process, Spares
from app.link.ring import Block

if TYPE_CHECKING:
    from lessons.settings.settings import SceneSettings

SILENCE = 3.0
"""Time without a report, s, after which a page shows this problem. A simulation reports ten times per
second."""
DEADLINE = 30.0
"""Largest time for loading a scene, s."""
T = TypeVar("T")
_COMPLAIN = 2.0  # s between two notices about lost commands


@dataclass(frozen=True)
class Trouble:
    """state: a word for the badge; sentence: the problem; offer: label of the button that starts the scene
    again; None if the learner can only wait."""

    state: Literal["STOPPED", "SILENT", "LOADING", "PREPARING", "YOUR CODE", "YOUR LESSON"]
    sentence: str
    offer: str | None = "Start again"


def trouble_of(process: Process, loading: bool, quiet: float, who: str = "The simulation") -> Trouble | None:
    """Returns the problem of a process that has not failed; None if there is no problem.

    Args:
        process: the process.
        loading: whether its last report says that it loads a scene.
        quiet: time since its last report, s.
        who: the first words of the sentence.
    """
    doing = process.preparing
    if quiet < SILENCE and not doing:
        return None
    waited = f"{quiet:.0f} s"
    if doing is not None:
        what = f": {doing}" if doing else ""
        sentence = f"The simulations are being prepared{what}, {waited} so far …"
        return Trouble("PREPARING", sentence, *(() if quiet > FIRST_PATIENCE else (None,)))
    if not loading:
        why = "this computer is too busy, or the simulation hangs"
        return Trouble("SILENT", f"{who} has not reported anything for {waited}: {why}.")
    if quiet < DEADLINE:
        return Trouble("LOADING", f"{who} is being loaded: {waited} of at most {DEADLINE:.0f} s.", "Cancel")
    why = "this computer is too busy, or the scene is too large"
    return Trouble("SILENT", f"{who} could not be loaded within {DEADLINE:.0f} s: {why} ({waited}).")


class Simulation(ABC):
    """Owns a process and stores its reports. Reports arrive on the thread of the process handle; the page
    reads the fields from its own loop. `changed` counts scenes and restarts: when it changes, the page is
    rebuilt."""

    who: str
    """The first words of sentences about this simulation."""

    def __init__(self, spares: Spares) -> None:
        self.ready: Ready | None = None
        self.status: Status | None = None
        self.settings: SceneSettings | None = None
        self.code = ""
        """The state code of the setting, as the process reported it; "" if there is none."""
        self.failure: str | None = None
        self.changed = 0
        self._recording: Recording | None = None
        self._refusals: list[str] = []
        self._notices: list[str] = []
        self._spares = spares
        self._lock = threading.RLock()
        self._closed = False
        self._loading = False
        self._next_complaint = 0.0
        self._start()

    def _start(self) -> None:
        process = self._process = self._spares.take()
        self._loading = False

        def hear(report: Report) -> None:
            self._hear(process, report)
            self._heard(process, report)

        process.listen(hear)

    @property
    def figures(self) -> RunFigures | None:
        """The figures of the run; None before the first row."""
        return self.read(lambda recording: recording.statistics.result())

    @property
    def pid(self) -> int | None:
        return self._process.pid

    def send(self, command: Command) -> None:
        """Sends a command without waiting. A command that does not fit into the queue is lost; a notice says
        so."""
        process = self._process
        if process.send(command) or not process.alive or time.monotonic() < self._next_complaint:
            return
        self._next_complaint = time.monotonic() + _COMPLAIN
        with self._lock:
            self._notices.append("The simulation does not answer: your last change is lost. Try again.")

    # ---------------------------------------------------------------- silence

    @property
    def quiet(self) -> float:
        """Time since the last report of the process, s."""
        return time.monotonic() - self._process.heard_at

    @property
    def compiles(self) -> bool:
        """Whether the controllers are being compiled, as at the first start."""
        return bool(self._process.preparing)

    def trouble(self) -> Trouble | None:
        """Returns the problem that the page should show; None if there is none."""
        if self.failure is not None:
            return Trouble("STOPPED", self.failure)
        return trouble_of(self._process, self._loading, self.quiet, self.who)

    # ---------------------------------------------------------------- reports

    def _hear(self, process: Process, report: Report) -> None:
        with self._lock:
            if self._closed or process is not self._process:
                _discard(report)
                return
            self._loading = isinstance(report, Loading)
            match report:
                case Ready():
                    self._enter(report)
                case Status():
                    self.status = report
                    self.settings = report.settings or self.settings
                    self.code = self.code if report.code is None else report.code
                    self._notices += report.notices
                case LoadRefused(sentence):
                    self._refusals.append(sentence)
                case SimulationFailed(sentence):
                    self.failure = sentence
                case _:
                    pass

    @abstractmethod
    def _heard(self, process: Process, report: Report) -> None:
        """Handles the other effects of a report, on the thread of the process that sent it."""

    def _enter(self, ready: Ready) -> None:
        before, block = self._recording, Block.for_robot(ready.robot, ready.layout.size, ready.block)
        again = None if before is None or not ready.again else before.under(block, ready.layout)
        self._free()
        self.ready, self.settings = ready, ready.settings
        self._recording = again or Recording(block, ready.layout)
        if not ready.again:
            self.status, self.code = None, ""
        self.changed += 1

    def _free(self) -> None:
        recording, self._recording = self._recording, None
        if recording is not None:
            recording.block.close()

    def take_messages(self) -> tuple[list[str], list[str]]:
        """Returns (refusals, notices) that arrived since the last call."""
        with self._lock:
            refusals, self._refusals = self._refusals, []
            notices, self._notices = self._notices, []
            return refusals, notices

    def settings_of(self, ready: Ready) -> SceneSettings:
        """Returns the settings of a loaded scene: the newest settings, or the settings at the scene's start
        if another scene was loaded since."""
        with self._lock:
            return ready.settings if self.settings is None or self.ready is not ready else self.settings

    # ---------------------------------------------------------------- telemetry

    def read(self, look: Callable[[Recording], T]) -> T | None:
        """Calls `look` and returns its result; the recorded block cannot be freed meanwhile. Returns None
        before the first scene."""
        with self._lock:
            return None if self._recording is None else look(self._recording)

    def look(self, rows: bool = True) -> float | None:
        """Records what is new, and returns the simulated time, s; see `Recording.look`."""
        return self.read(lambda recording: recording.look(self.status, rows))

    def close(self) -> None:
        with self._lock:
            self._closed = True
        self._process.close()
        with self._lock:
            self._free()


def _discard(report: Report) -> None:
    """Frees the memory of a scene that was loaded too late to be used."""
    if isinstance(report, Ready):
        os.close(report.block)
