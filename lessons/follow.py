"""A second session that lives through what a first one lives through, with some settings of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lessons.events import Event, MoveLevel, Reset, Set
from lessons.run import with_assignments
from lessons.scene import Scene
from lessons.session import Session
from lessons.settings import SceneSettings, changed
from robots import InputError

Array = NDArray[np.float64]

_SAME = 1e-6
"""s: times closer than this are the same moment; ticks are further apart."""


class Follower:
    """Runs up to where the leader is, and takes each event at the very tick at which the leader took it.

    The follower's settings are, at any time, the leader's with its own assignments on top: a leader that
    changes what defines the difference changes nothing here, whatever else it changes is changed here, too.
    With no assignments the rows are the leader's to the last bit.

    A reset is taken as soon as it is heard of, even if the follower had not yet come to where the leader was.
    """

    def __init__(self, scene: Scene, leader: SceneSettings, own: Sequence[str], seed: int = 0) -> None:
        """scene: as the leader loaded it; leader: its settings at the last reset, where both begin; own:
        assignments; seed: the leader's. Raises InputError if the assignments do not fit the scene."""
        self._leader = leader
        self._own = tuple(own)
        # The leader's log holds what its scene's own script did.
        self.session = Session(replace(scene, settings=with_assignments(leader, self._own), events=()), seed)
        self._script: deque[tuple[float, Event]] = deque()
        self._until = 0.0

    @property
    def behind(self) -> float:
        """s of the leader's time that are still to be run."""
        return max(0.0, self._until - self.session.t)

    def hear(self, script: Iterable[tuple[float, Event]], until: float) -> None:
        """What the leader's log gained, and the time the leader has come to, s: an event of earlier than
        that will not come any more."""
        self._script.extend(script)
        self._until = until
        self._skip_to_reset()
        self._take_due()

    def tick(self) -> Array | None:
        """One control period; its row as of `Session.tick`. None: the leader is no further."""
        session = self.session
        if session.t + session.settings.T_s > self._until + _SAME:
            return None
        row = session.tick()
        self._take_due()
        return row

    def _skip_to_reset(self) -> None:
        resets = [k for k, (_, event) in enumerate(self._script) if isinstance(event, Reset)]
        for _ in range(resets[-1] + 1 if resets else 0):
            self._take(self._script.popleft()[1])

    def _take_due(self) -> None:
        while self._script and self._script[0][0] <= self.session.t + _SAME:
            self._take(self._script.popleft()[1])
        self.session.drain()

    def _take(self, event: Event) -> None:
        if not isinstance(event, (Set, MoveLevel)):
            self.session.post(event)
            self.session.drain()
            return
        before, self._leader = self._leader, _after(self._leader, event)
        try:
            settings = with_assignments(self._leader, self._own)
            # The leader's controller was told, even if that was what it had: so is the follower's.
            if settings != self.session.settings or self._leader == before:
                self.session.adopt(settings)
        except InputError as error:
            self.session.notices.append(str(error))


def _after(settings: SceneSettings, event: Set | MoveLevel) -> SceneSettings:
    if isinstance(event, Set):
        return changed(settings, event.path, event.value)
    return replace(settings, levels=moved(settings.levels, event.level, event.to))
