"""A mission: the ordered tasks 𝒯₁, 𝒯₂, … that the motion planner of the HTMPC paper passes to its task
manager."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from himpc.references import Hold, Law, Path, Reference, Started
from himpc.rotation import from_quaternion
from robots import InputError
from robots.arrays import Array
from robots.errors import unknown_name

Point = tuple[float, ...]


@dataclass(frozen=True)
class Go:
    """A motion to a goal: a waypoint (x_d is the goal at once) or, with a cruise speed, a planned path.

    Attributes:
        goal: position in the world, m.
        cruise: cruise speed, m/s; None: a waypoint.
        law: time law of the path.
        via: points on the way to the goal, m; they need a cruise speed.
    """

    goal: Point
    cruise: float | None = None
    law: Law = "quintic"
    via: tuple[Point, ...] = ()

    def __post_init__(self) -> None:
        if not all(math.isfinite(x) for point in (self.goal, *self.via) for x in point):
            raise InputError(f"goal {list(self.goal)} or a point on the way to it is not finite")
        if any(len(point) != len(self.goal) for point in self.via):
            raise InputError(f"every point on the way to {list(self.goal)} needs {len(self.goal)} numbers")
        if self.via and self.cruise is None:
            raise InputError("points on the way need a cruise speed: give one, e.g. 0.5 m/s")

    def planned(self, start: Array, t: float) -> tuple[Reference, float]:
        """Returns the reference from a start (m,) at time t (s), and the earliest time at which the goal
        counts as reached, s."""
        if self.cruise is None:
            return Hold(np.array(self.goal)), t
        path = Path(np.array([start, *self.via, self.goal], float), self.cruise, self.law, t)
        return path, t + path.duration if self.via else t


@dataclass(frozen=True, eq=False)
class Follow:
    """A given trajectory.

    Attributes:
        reference: the trajectory; its time is zero when the task enters the window.
        duration: time after which the last point of the trajectory is the goal, s; infinite: the trajectory
            never ends.
    """

    reference: Reference
    duration: float = math.inf

    @property
    def rotation(self) -> Array | None:
        """The orientation (3, 3) if the reference is a constant orientation; None otherwise."""
        reference = self.reference
        return reference.value if isinstance(reference, Hold) and reference.value.ndim == 2 else None

    def turned(self, xyzw: Point) -> Follow:
        """Returns the same trajectory with another constant orientation. Raises InputError if `xyzw` is not a
        quaternion x y z w."""
        if len(xyzw) != 4 or not all(math.isfinite(x) for x in xyzw) or not any(xyzw):
            raise InputError(f"an orientation is a quaternion x y z w, not {list(xyzw)}")
        assert isinstance(self.reference, Hold)
        return replace(self, reference=replace(self.reference, value=from_quaternion(np.array(xyzw))))

    def planned(self, start: Array, t: float) -> tuple[Reference, float]:
        """Returns the reference, which starts at time t (s), and the time at which it ends, s."""
        return Started(self.reference, t), t + self.duration


@dataclass(frozen=True, eq=False)
class MissionTask:
    """One tracking task 𝒯_l.

    The task is completed when its point has been at the goal for `hold` seconds: within `tolerance`, and not
    faster than `rest`. Only the time in which the task is the first in the window counts.

    Attributes:
        name: the unique name of the task, which events refer to.
        role: the point of the robot that the task moves, e.g. "ee" or "base".
        motion: motion to the goal, or a given trajectory.
        tolerance: largest distance from the goal, m.
        hold: time at the goal, s; None: until an event releases the task.
        rest: largest speed at the goal, m/s; infinite: the goal may be passed at any speed.
    """

    name: str
    role: str
    motion: Go | Follow
    tolerance: float = 0.02
    hold: float | None = 0.0
    rest: float = math.inf

    def __post_init__(self) -> None:
        """Raises InputError for an invalid tolerance, hold or rest."""
        if not (math.isfinite(self.tolerance) and self.tolerance > 0):
            raise InputError(f"tolerance of task '{self.name}' is {self.tolerance} m: give a number above 0")
        if self.hold is not None and not (math.isfinite(self.hold) and self.hold >= 0):
            raise InputError(f"hold of task '{self.name}' is {self.hold} s: give 0 or more, or null")
        if not self.rest > 0:
            raise InputError(f"rest of task '{self.name}' is {self.rest} m/s: give a number above 0")


Mission = tuple[MissionTask, ...]


def check_mission(mission: Mission) -> None:
    """Raises InputError for a mission without tasks or with two tasks of one name."""
    if not mission:
        raise InputError("a mission needs at least one task")
    names = [task.name for task in mission]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"task name '{name}' occurs twice in the mission: rename one of the tasks")


def find(mission: Mission, name: str) -> int:
    """Returns the index of a task. For an unknown name it raises InputError, which suggests the most similar
    name."""
    names = [task.name for task in mission]
    if name not in names:
        raise unknown_name("task of the mission called", name, names)
    return names.index(name)
