"""A second session that lives through what a first one lives through, with some settings of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from lessons.events import MoveLevel, Reset, Set
from lessons.kinds import AnyEvent, AnyScene, AnySession, AnySettings, prepared, settings_after
from lessons.recording.run import parse_assignment
from lessons.scenes.torque_scene import Scene
from lessons.scenes.velocity_scene import MobileScene
from lessons.session.torque import Session
from lessons.session.velocity import MobileSession
from lessons.settings.assignments import assignment
from lessons.settings.torque import SceneSettings, value_at
from lessons.settings.velocity import MobileSettings
from lessons.settings.velocity import value_at as mobile_value_at
from lessons.velocity_events import Appear
from robots import InputError

_SAME = 1e-6
"""s: times closer than this are the same moment; ticks are further apart."""


def followed(scene: AnyScene, leader: AnySettings, own: Sequence[str]) -> AnyScene:
    """The scene that a follower runs.

    Args:
        scene: as the leader loaded it.
        leader: the leader's settings at its last reset, where both begin.
        own: assignments "PATH=VALUE" on top of them.

    Raises:
        InputError: the assignments do not fit the scene.
    """
    # What the scene's own script does is in the leader's log.
    return replace(_with(scene, leader, own), events=())


class Follower:
    """Runs up to where the leader is, and takes each event at the very tick at which the leader took it.

    The follower's settings are, at any time, the leader's with its own assignments on top: a leader that
    changes what defines the difference changes nothing here, whatever else it changes is changed here, too.
    With no assignments the rows are the leader's to the last bit.

    A reset is taken as soon as it is heard of, even if the follower had not yet come to where the leader was.
    """

    def __init__(self, session: AnySession, leader: AnySettings, own: Sequence[str]) -> None:
        """session: of `followed`, fresh; leader: the leader's settings at the last reset, where both begin;
        own: assignments."""
        self.session = session
        self._scene = session.scene
        self._leader = leader
        self._own = tuple(own)
        self._script: deque[tuple[float, AnyEvent]] = deque()
        self._until = 0.0

    @property
    def behind(self) -> float:
        """s of the leader's time that are still to be run."""
        return max(0.0, self._until - self.session.t)

    def hear(self, script: Iterable[tuple[float, AnyEvent]], until: float) -> None:
        """What the leader's log gained, and the time the leader has come to, s: an event of earlier than
        that will not come any more."""
        self._script.extend(script)
        self._until = until
        self._skip_to_reset()
        self.take()

    @property
    def due(self) -> bool:
        """Whether the leader is at least one of the follower's control periods further."""
        return self.session.t + self.session.settings.T_s <= self._until + _SAME

    def take(self) -> None:
        """Takes the events that are due; to be called after every control period."""
        while self._script and self._script[0][0] <= self.session.t + _SAME:
            self._take(self._script.popleft()[1])
        self.session.drain()

    def _skip_to_reset(self) -> None:
        resets = [k for k, (_, event) in enumerate(self._script) if isinstance(event, Reset)]
        for _ in range(resets[-1] + 1 if resets else 0):
            self._take(self._script.popleft()[1])

    def _take(self, event: AnyEvent) -> None:
        if not _sets(event, self._leader):
            self.session.post(event)  # pyright: ignore[reportArgumentType]
            self.session.drain()
            return
        before = self._leader
        settings = self._leader = settings_after(before, (event,))
        try:
            found = _with(self._scene, settings, self._own).settings
            # A leader that sets what it had already tells its controller all the same: so does a follower.
            if found != self.session.settings or settings == before:
                self._adopt(found)
        except InputError as error:
            self.session.notices.append(str(error))

    def _adopt(self, settings: AnySettings) -> None:
        match self.session, settings:
            case Session(), SceneSettings():
                self.session.adopt(settings)
            case MobileSession(), MobileSettings():
                self.session.adopt(settings)
            case _:
                raise TypeError("a session never changes its kind")


def swapped(settings: AnySettings, own: Sequence[str]) -> tuple[tuple[str, ...], tuple[Set, ...]]:
    """What leader and follower get when they change sides.

    Args:
        settings: the leader's.
        own: the follower's assignments.

    Returns:
        the follower's new assignments, with the leader's present values; and the events that give the leader
        the follower's.

    Raises:
        InputError: an assignment sets more than one value, or fits nothing here.
    """
    given = [parse_assignment(text) for text in own]
    try:
        kept = tuple(assignment(path, _value(settings, path)) for path, _ in given)
    except (AttributeError, StopIteration):
        raise InputError(
            f"{', '.join(own)} cannot change sides: name a level or a task, e.g. levels.position.Q=50"
        ) from None
    return kept, tuple(Set(path, value) for path, value in given)


def _value(settings: AnySettings, path: str) -> Any:
    if isinstance(settings, SceneSettings):
        return value_at(settings, path)
    return mobile_value_at(settings, path)


def _with(scene: AnyScene, settings: AnySettings, own: Sequence[str]) -> AnyScene:
    match scene, settings:
        case Scene(), SceneSettings():
            return prepared(replace(scene, settings=settings), None, own)
        case MobileScene(), MobileSettings():
            return prepared(replace(scene, settings=settings), None, own)
        case _:
            raise TypeError("a scene and its settings are of one kind")


def _sets(event: AnyEvent, settings: AnySettings) -> bool:
    """Whether an event changes settings, not only what the robot is to do."""
    return isinstance(event, (Set, Appear)) or (
        isinstance(event, MoveLevel) and isinstance(settings, SceneSettings)
    )
