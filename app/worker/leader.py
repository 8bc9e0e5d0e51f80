"""A simulation that a ghost follows: what the ghost must hear, and how far it may be left behind."""

from __future__ import annotations

import math

from app.link.choice import SceneChoice
from app.link.messages import Begin, Script
from lessons.session.session import Session


class Leader:
    """Off until `begin`. Its ghost hears everything that took effect since, in order."""

    def __init__(self) -> None:
        self.on = False
        self.until = math.inf
        self._begin: Begin | None = None
        self._told = 0
        self._t = math.nan

    def begin(self, choice: SceneChoice, session: Session) -> None:
        """The session was just reset: its ghost begins here, and until it is there no time passes."""
        self.on, self.until = True, 0.0
        self._begin = Begin(choice, session.settings)
        self._told = len(session.log)

    def end(self) -> None:
        """Nobody follows any more."""
        self.on, self.until = False, math.inf

    def waits(self, t: float) -> bool:
        """Whether going on to t (s) would leave the ghost too far behind."""
        return t > self.until + 1e-9

    def script(self, session: Session) -> Script | None:
        """What is new since the last call, if anything is."""
        if not self.on:
            return None
        begin, self._begin = self._begin, None
        events = tuple(session.log[self._told :])
        if begin is None and not events and session.t == self._t:
            return None
        self._told += len(events)
        self._t = session.t
        return Script(events, session.t, begin)
