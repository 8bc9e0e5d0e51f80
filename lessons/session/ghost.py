"""A ghost: a session that gets the same events as another session, but has some different settings."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import replace

from lessons.events import Event, Reset, Set
from lessons.scenes.catalog import prepared
from lessons.scenes.scene import Scene
from lessons.session.session import Session
from lessons.settings.assignments import assignment, parse_assignment
from lessons.settings.settings import SceneSettings
from robots import InputError

_SAME = 1e-6
"""s: times closer than this count as the same moment; ticks are further apart."""


def ghost_scene(scene: Scene, leader: SceneSettings, own: Sequence[str]) -> Scene:
    """Returns the scene that a ghost runs.

    Args:
        scene: the scene, as the leader loaded it.
        leader: the leader's settings at its last reset, at which both begin.
        own: assignments "PATH=VALUE" on top of them.

    Raises:
        InputError: the assignments do not fit the scene.
    """
    # The events of the scene's own script are in the leader's log.
    return replace(_with(scene, leader, own), events=())


class GhostDriver:
    """Runs a ghost's session up to the leader's time, and applies each event at the same tick as the leader.

    The ghost's settings are, at any time, the leader's with its own assignments on top: if the leader changes
    a setting that the ghost assigns itself, the ghost does not change; every other change applies to the
    ghost, too. Without assignments, the ghost's rows are equal to the leader's to the last bit.

    A reset takes effect at once, even if the ghost had not yet reached the leader's time.
    """

    def __init__(self, session: Session, leader: SceneSettings, own: Sequence[str]) -> None:
        """session: a new session of `ghost_scene`; leader: the leader's settings at the last reset, at which
        both begin; own: the ghost's own assignments."""
        self.session = session
        self._scene = session.scene
        self._leader = leader
        self._own = tuple(own)
        self._script: deque[tuple[float, Event]] = deque()
        self._until = 0.0

    @property
    def behind(self) -> float:
        """Time by which the ghost is behind the leader, s."""
        return max(0.0, self._until - self.session.t)

    def hear(self, script: Iterable[tuple[float, Event]], until: float) -> None:
        """Receives the new events of the leader's log, and the leader's present time, s. All events before
        that time have then been received: later calls contain none of them.
        """
        self._script.extend(script)
        self._until = until
        self._skip_to_reset()
        self.take()

    @property
    def due(self) -> bool:
        """Whether the leader is at least one of the ghost's control periods ahead."""
        return self.session.t + self.session.settings.T_s <= self._until + _SAME

    def take(self) -> None:
        """Applies the events that are due. It must be called after every control period."""
        while self._script and self._script[0][0] <= self.session.t + _SAME:
            self._take(self._script.popleft()[1])
        self.session.drain()

    def _skip_to_reset(self) -> None:
        resets = [k for k, (_, event) in enumerate(self._script) if isinstance(event, Reset)]
        for _ in range(resets[-1] + 1 if resets else 0):
            self._take(self._script.popleft()[1])

    def _take(self, event: Event) -> None:
        if not self._leader.takes(event):
            self.session.post(event)
            self.session.drain()
            return
        before = self._leader
        settings = self._leader = before.after(event)
        try:
            merged = _with(self._scene, settings, self._own).settings
            # A leader configures its controller even if a setting does not change; so does a ghost.
            if merged != self.session.settings or settings == before:
                self.session.adopt(merged)
        except InputError as error:
            self.session.notices.append(str(error))


def swapped(settings: SceneSettings, own: Sequence[str]) -> tuple[tuple[str, ...], tuple[Set, ...]]:
    """Returns the changes with which leader and ghost exchange the values of the ghost's assignments.

    Args:
        settings: the leader's.
        own: the ghost's assignments.

    Returns:
        the ghost's new assignments, with the leader's present values; and the events that give the ghost's
        values to the leader.

    Raises:
        InputError: an assignment sets more than one value, or has an unknown path.
    """
    pairs = [parse_assignment(text) for text in own]
    table = settings.table()
    if any(path not in table or table[path].shorthand for path, _ in pairs):
        raise InputError(
            f"{', '.join(own)} cannot be swapped between robot and ghost: name a level or a task, "
            "e.g. levels.position.Q=50"
        )
    kept = tuple(assignment(path, settings.value_at(path)) for path, _ in pairs)
    return kept, tuple(Set(path, value) for path, value in pairs)


def _with(scene: Scene, settings: SceneSettings, own: Sequence[str]) -> Scene:
    return prepared(replace(scene, settings=settings), None, own)
