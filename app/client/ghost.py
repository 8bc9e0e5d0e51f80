"""The page's handle of a ghost: a second robot that runs the same scene with other settings."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import final

from app.client.simulation import Simulation
from app.link.messages import FollowLeader, LoadRefused, Reached, Report, Script, SimulationFailed
from app.link.process import Process, Spares

LEAD = 0.2
"""Largest simulated time, s, by which the robot may be ahead of its ghost. If the ghost is too slow, both
slow down, and the page says so. A ghost that lags would look like a ghost that tracks its target badly."""


@final
class GhostClient(Simulation):
    """The process of a ghost that follows a leader. The first `Script` report contains the start of the
    ghost. The ghost reports the time that it has reached; this time limits the leader's advance."""

    who = "The ghost"

    def __init__(
        self,
        words: str,
        own: tuple[str, ...],
        spares: Spares,
        reached: Callable[[float], None],
        lost: Callable[[GhostClient, str], None],
    ) -> None:
        """words: the ghost's name in the legend; own: assignments "PATH=VALUE" on top of the leader's
        settings; reached: called with the time that the ghost has reached, s; lost: called with a sentence
        when the ghost cannot start or has ended. Both functions are called on a thread of the process
        handle."""
        self.words, self.own = words, own
        self._reached, self._lost = reached, lost
        self._told_at: float | None = None
        super().__init__(spares)

    def hear(self, script: Script) -> None:
        """Passes a report of the leader on to the ghost."""
        if self._told_at is None:
            self._told_at = time.monotonic()
        self.send(FollowLeader(script, self.own))

    @property
    def quiet(self) -> float:
        """As `Simulation.quiet`; 0 before the ghost has received its first command."""
        return 0.0 if self._told_at is None else min(super().quiet, time.monotonic() - self._told_at)

    def _heard(self, process: Process, report: Report) -> None:
        match report:
            case Reached(t):
                self._reached(t + LEAD)
            case LoadRefused(sentence) | SimulationFailed(sentence):
                self._lost(self, sentence)
            case _:
                pass
