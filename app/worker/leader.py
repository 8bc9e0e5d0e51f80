"""The leader of a ghost: the events to send to the ghost, and the limit on the ghost's lag."""

from __future__ import annotations

import math

from app.link.choice import SceneChoice
from app.link.messages import Begin, Script
from lessons.session.session import Session


class Leader:
    """The events for a ghost. Before `begin` there is no ghost. Afterwards the ghost receives all events that
    took effect, in order."""

    def __init__(self) -> None:
        self.on = False
        self.until = math.inf
        self._begin: Begin | None = None
        self._told = 0
        self._t = math.nan

    def begin(self, choice: SceneChoice, session: Session) -> None:
        """Called when the session has just been reset and the ghost begins. The simulation then waits until
        the ghost has started."""
        self.on, self.until = True, 0.0
        self._begin = Begin(choice, session.settings)
        self._told = len(session.log)

    def end(self) -> None:
        """Called when the ghost no longer follows."""
        self.on, self.until = False, math.inf

    def waits(self, t: float) -> bool:
        """Returns whether a step to time t (s) would leave the ghost too far behind."""
        return t > self.until + 1e-9

    def script(self, session: Session) -> Script | None:
        """Returns the events and the time reached since the last call; None if nothing has changed."""
        if not self.on:
            return None
        begin, self._begin = self._begin, None
        events = tuple(session.log[self._told :])
        if begin is None and not events and session.t == self._t:
            return None
        self._told += len(events)
        self._t = session.t
        return Script(events, session.t, begin)
