"""The page's handle of a ghost: a second robot that does the same with other settings."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import final

from app.client.simulation import Simulation
from app.link.messages import FollowLeader, LoadRefused, Reached, Report, Script, SimulationFailed
from app.link.process import Process
from app.link.spares import Spares

LEAD = 0.2
"""s of simulated time that the robot may be ahead of its ghost. A ghost that cannot keep up slows both down,
and the page says so: one that lagged behind would look like one that follows its target badly."""


@final
class GhostClient(Simulation):
    """A process that follows. It begins where the first script says, and what it tells of the time it has
    come to tells its leader how far it may go."""

    who = "The ghost"

    def __init__(
        self,
        words: str,
        own: tuple[str, ...],
        spares: Spares,
        reached: Callable[[float], None],
        lost: Callable[[GhostClient, str], None],
    ) -> None:
        """words: what it is, for the legend; own: assignments "PATH=VALUE" on top of the leader's settings;
        reached: told the time it has come to, s; lost: told why there is no ghost (any more). Both are called
        on a thread of the process."""
        self.words, self.own = words, own
        self._reached, self._lost = reached, lost
        self._told_at: float | None = None
        super().__init__(spares)

    def hear(self, script: Script) -> None:
        """Passes on what the leader told."""
        if self._told_at is None:
            self._told_at = time.monotonic()
        self.send(FollowLeader(script, self.own))

    @property
    def quiet(self) -> float:
        """As `Simulation.quiet`; before it was told anything it has nothing to say."""
        return 0.0 if self._told_at is None else min(super().quiet, time.monotonic() - self._told_at)

    def _heard(self, process: Process, report: Report) -> None:
        match report:
            case Reached(t):
                self._reached(t + LEAD)
            case LoadRefused(sentence) | SimulationFailed(sentence):
                self._lost(self, sentence)
            case _:
                pass
