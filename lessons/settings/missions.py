"""The missions of the velocity-level scenes: the options of each scene, and the mission made from them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np

from himpc.missions import Follow, Go, Mission, MissionTask
from himpc.references import Hold, Path, SquareWave
from robots import InputError
from robots.arrays import Array
from robots.collision import Ball, Box, Floor, Obstacle
from robots.ranges import Range, Shown, check_fields

Home = Mapping[str, Array]
Architecture = Literal["hierarchical", "single_task", "decoupled"]
"""How a sequence is carried out: two tasks at a time (L = 2), one task at a time by the whole body (L = 1),
or one task at a time by base or arm. In the last architecture the base drives with the arm at rest, then the
arm moves and the base may turn. This architecture has no plan for the arm: if the arm is folded against its
limits, it sometimes cannot reach a goal behind itself."""


@dataclass(frozen=True)
class MissionOptions(ABC):
    """The options of a scene; each field is a path of its own (`--set peak=[-2,1]`)."""

    parts: ClassVar[tuple[str, ...]] = ()
    """Names of equally long parts of the run that are evaluated separately."""

    @property
    def part_s(self) -> float:
        """Length of each part, s."""
        return 0.0

    @abstractmethod
    def mission(self, home: Home) -> Mission:
        """Returns the tasks. Args: home: position of each role's point at the start, (m,) m."""

    @property
    def L(self) -> int:
        """Tasks in the window."""
        return 2

    @property
    def decoupled(self) -> bool:
        """Whether base and arm move in turns: one of them stands still while the other carries out its
        task."""
        return False

    def person(self, task: str) -> int | None:
        """Returns the number of the person that a task of the mission visits, from 0; None: nobody."""
        return None

    @property
    def misreported(self) -> tuple[float, float] | None:
        """The time from which an obstacle is reported at a wrong place, and the time from which it is
        reported at its true place again, s. None: every report is right."""
        return None

    def reported(self, obstacles: tuple[Obstacle, ...], t: float) -> tuple[Obstacle, ...]:
        """Returns the obstacles as they are reported to the controller at time t, s."""
        del t
        return obstacles


@dataclass(frozen=True)
class ArchitectureOptions(MissionOptions):
    """Scenes that compare architectures.

    The architectures differ only in the tasks of the window. The HTMPC paper does not print when a task
    counts as completed, so this is an option, whose value applies to all architectures.

    Attributes:
        base_at_rest: whether the base must also be slower than REST.
    """

    # fmt: off
    architecture: Annotated[Architecture, Shown(
        "Architecture", "hierarchical: the robot carries out two tasks at a time. single_task: one task at a "
        "time, with the whole body. decoupled: one task at a time, with the base or the arm",
    )] = "hierarchical"
    base_tolerance: Annotated[float, Range(0.0, 1e3, above=True), Shown(
        "Base is there within", "The task of the base is completed within this distance of its goal, for "
        "every architecture; takes effect at the next start. decoupled needs 0.05 m and a base at rest", "m",
        0.02, 1.0, 0.01, tries=("0.05", "0.25", "0.5"), name="base is there within, m")] = 0.8
    base_at_rest: Annotated[bool, Shown(
        "and at rest", "The task of the base is completed only if the base is slower than 0.02 m/s",
        tries=("true",), name="base must come to rest")] = False
    # fmt: on

    def __post_init__(self) -> None:
        """Raises InputError for invalid options."""
        check_fields(self)

    @property
    def L(self) -> int:
        return 2 if self.architecture == "hierarchical" else 1

    @property
    def decoupled(self) -> bool:
        return self.architecture == "decoupled"

    def drive(self, name: str, goal: Go) -> MissionTask:
        """Returns a task of the base."""
        rest = REST if self.base_at_rest else math.inf
        return MissionTask(name, "base", goal, self.base_tolerance, rest=rest)


@dataclass(frozen=True)
class OrderOptions(MissionOptions):
    """Scenes whose tasks last for the whole run, so that the user can choose which task comes first.

    Attributes:
        order: the roles, highest priority first; empty: the scene's own order.
    """

    # fmt: off
    order: Annotated[tuple[str, ...], Shown(
        "Order", "The roles, highest priority first: ee,base; takes effect when a run starts")] = ()
    # fmt: on

    def in_order(self, tasks: Mission) -> Mission:
        """Returns the tasks by the priorities of their roles. Raises InputError if a role is missing or
        unknown."""
        if not self.order:
            return tasks
        by_role = {task.role: task for task in tasks}
        if sorted(self.order) != sorted(by_role):
            raise InputError(
                f"order is {list(self.order)}: give every role once, e.g. order={','.join(by_role)}"
            )
        return tuple(by_role[role] for role in self.order)


@dataclass(frozen=True)
class Stay(OrderOptions):
    """Both targets stay at their places until a user drags them."""

    def mission(self, home: Home) -> Mission:
        return self.in_order(
            tuple(MissionTask(role, role, _staying(point), hold=None) for role, point in home.items())
        )


def _staying(point: Array) -> Go | Follow:
    return Go(tuple(point.tolist())) if point.ndim == 1 else Follow(Hold(point))


@dataclass(frozen=True)
class SquareOptions(OrderOptions):
    """Section V-A: the EE holds its home position while the base is sent to a peak and back.

    Attributes:
        peak: m, world; the default lies 2.2 m from the EE's home.
    """

    # fmt: off
    peak: Annotated[tuple[float, ...], Range(-1e3, 1e3), Shown(
        "Peak", "Goal of the base, x and y in the world frame", "m")] = (0.4, -1.75)
    half_period: Annotated[float, Range(0.0, 1e5, above=True), Shown(
        "Half period", "Duration of each of the two parts", "s", 1.0, 20.0, 0.5)] = 8.0
    # fmt: on

    parts: ClassVar[tuple[str, ...]] = ("peak", "valley")

    def __post_init__(self) -> None:
        if len(self.peak) != 2:
            raise InputError(f"peak has {len(self.peak)} numbers: give x and y, e.g. [-2, 1]")
        check_fields(self)

    @property
    def part_s(self) -> float:
        return self.half_period

    def mission(self, home: Home) -> Mission:
        wave = SquareWave(np.array(self.peak), home["base"], self.half_period, waves=1)
        return self.in_order(
            (
                MissionTask("ee", "ee", Follow(Hold(home["ee"]))),
                MissionTask("base", "base", Follow(wave)),
            )
        )


def random_peaks(seed: int, count: int, ee_home: Array) -> list[tuple[float, float]]:
    """Peaks out of reach, m: 1.83 + U(0.25, 0.5) m from the EE's home, less than 3 m from the origin."""
    rng = np.random.default_rng(seed)
    peaks: list[tuple[float, float]] = []
    while len(peaks) < count:
        radius, angle = 1.83 + rng.uniform(0.25, 0.5), rng.uniform(-np.pi, np.pi)
        x, y = ee_home[:2] + radius * np.array([np.cos(angle), np.sin(angle)])
        if np.hypot(x, y) < 3.0:
            peaks.append((float(x), float(y)))
    return peaks


CRUISE = 0.5
"""Speed of the planned base and EE paths, m/s."""
HAND_TOLERANCE = 0.02
"""m: a task of the EE is completed within this distance of its goal, whatever the architecture."""
REST = 0.02
"""m/s: a slower base counts as at rest."""
_ANYWHERE = 100.0
"""m: a distance larger than any scene."""


@dataclass(frozen=True)
class WaypointOptions(ArchitectureOptions):
    """Fig. 8: two EE waypoints; between the two, the base drives past the first one.

    The hierarchical architecture sends the base straight to its place for the second waypoint. The
    single-task architecture first sends the base to a place at a predefined distance from the first waypoint.
    """

    # fmt: off
    height: Annotated[float, Range(-1e3, 1e3), Shown(
        "Height", "Height of the first waypoint of the hand", "m", 0.3, 1.5, 0.05)] = 0.8
    hold_s: Annotated[float, Range(0.0, 1e5), Shown(
        "Hold", "Time that the hand stays at each goal; null: until it is released", "s", 0.0, 5.0, 0.25,
    )] = 1.0
    # fmt: on

    def mission(self, home: Home) -> Mission:
        first, second = (2.4, 2.2, self.height), (6.0, 0.5, 0.8)
        base = Go((4.8, 0.0), CRUISE)
        ee_1 = MissionTask("ee 1", "ee", Go(first, CRUISE), HAND_TOLERANCE, self.hold_s)
        ee_2 = MissionTask("ee 2", "ee", Go(second, CRUISE), HAND_TOLERANCE, self.hold_s)
        if self.architecture != "hierarchical":
            return (self.drive("base 1", Go((2.0, 1.4), CRUISE)), ee_1, self.drive("base 2", base), ee_2)
        # Without a task below it, the last EE task would move the base, too. The task `stay` is
        # completed wherever the base is: the mission ends with the last EE task, as with one task at a time.
        stay = MissionTask("stay", "base", base, _ANYWHERE)
        return (ee_1, self.drive("base 2", base), ee_2, stay)


SEATS: tuple[tuple[tuple[float, float, float], tuple[float, float]], ...] = (
    ((2.5, 1.0, 0.8), (1.75, 0.703)),
    ((0.0, 2.0, 0.8), (0.0, 1.2)),
    ((-2.5, 1.0, 0.8), (-1.75, 0.703)),
    ((-2.5, -1.0, 0.8), (-1.75, -0.703)),
    ((0.0, -2.0, 0.8), (0.0, -1.2)),
    ((2.5, -1.0, 0.8), (1.75, -0.703)),
)
"""(hand of the person, place of the base), m, anticlockwise from (2.5, 1)."""

MAX_VISITS = 100
"""Largest number of visits per round, and of rounds: a mission is a list of all its tasks."""


@dataclass(frozen=True)
class DeliveryOptions(ArchitectureOptions):
    """Section V-D: balls are delivered to three people, in several rounds.

    Attributes:
        seats: indices in SEATS of the people's places, in the order of the visits.
        hold_s: time that the EE stays at a person's hand, s; null: until the person takes the ball (event
            Release).
    """

    # fmt: off
    hold_s: Annotated[float | None, Range(0.0, 1e5), Shown(
        "Hold", "Time that the hand stays at each goal; null: until it is released", "s", 0.0, 5.0, 0.25,
    )] = 1.0
    seats: Annotated[tuple[float, ...], Shown(
        "Seats", "Numbers of the people's seats, 0 to 5, in the order of the visits")] = (0, 2, 5)
    rounds: Annotated[int, Range(1, MAX_VISITS), Shown(
        "Rounds", "Number of visits to each person", low=1, high=10)] = 4
    cruise: Annotated[float, Range(0.0, 100.0, above=True), Shown(
        "Cruise", "Speed along the planned paths of the base", "m/s", 0.1, 1.0, 0.05)] = CRUISE
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.seats or any(seat not in range(len(SEATS)) for seat in self.seats):
            raise InputError(f"seats are {list(self.seats)}: give whole numbers from 0 to {len(SEATS) - 1}")
        if len(self.seats) > MAX_VISITS:
            raise InputError(f"seats has {len(self.seats)} entries: give at most {MAX_VISITS}")

    def person(self, task: str) -> int | None:
        visits = {_visit("ee", visit): visit for visit in range(1, len(self.seats) * self.rounds + 1)}
        return (visits[task] - 1) % len(self.seats) if task in visits else None

    def mission(self, home: Home) -> Mission:
        tasks: list[MissionTask] = []
        for visit, seat in enumerate([int(seat) for seat in self.seats] * self.rounds, start=1):
            hand, stand = SEATS[seat]
            tasks.append(self.drive(_visit("base", visit), Go(stand, self.cruise)))
            tasks.append(MissionTask(_visit("ee", visit), "ee", Go(hand), HAND_TOLERANCE, self.hold_s))
        return tuple(tasks)


def _visit(role: str, number: int) -> str:
    """Returns the name of the task of a role in one visit of a delivery."""
    return f"{role} {number}"


# ------------------------------------------------------------------ among obstacles


CLUTTER: tuple[Obstacle, ...] = (
    Floor(),
    Box("table", (2.0, 0.95, 0.4), (1.2, 0.5, 0.8)),
    Ball("bin", (1.6, -1.0, 0.3), 0.3),
    Ball("lamp", (3.4, 0.55, 1.3), 0.2),
)
"""Obstacles on both sides of the base's path."""


@dataclass(frozen=True)
class ClutteredOptions(MissionOptions):
    """The base is sent past obstacles; the EE goes first to a place beside the way."""

    goal: Annotated[tuple[float, ...], Range(-1e3, 1e3), Shown("Goal", "Goal of the base, x and y", "m")] = (
        4.0,
        0.0,
    )

    def mission(self, home: Home) -> Mission:
        return (
            MissionTask("ee", "ee", Go((4.9, 0.2, 0.9)), hold=3.0),
            MissionTask("base", "base", Go(self.goal), 0.02),
        )


WAY = 4.0
"""Length of the way of hand and base along x, m."""
CRATE = "crate"
"""Name of the obstacle that is reported wrongly."""
BESIDE_THE_WAY: tuple[Obstacle, ...] = (Floor(), Box(CRATE, (1.9, 1.4, 0.25), (0.4, 0.4, 0.5)))
"""A crate, low enough for the hand to pass above it, 1.2 m beside the way of the base."""


@dataclass(frozen=True)
class PerceptionOptions(OrderOptions):
    """Hand and base move along straight parallel paths, and for a while the crate is reported elsewhere.

    The controller avoids the crate at its reported place; whether something is touched depends on its true
    place.

    Attributes:
        report_offset: the reported position minus the true one while the report is wrong, m.
        report_start, report_end: times from which the report is wrong, and from which it is right again, s.
    """

    # fmt: off
    cruise: Annotated[float, Range(0.0, 100.0, above=True), Shown(
        "Cruise", "Speed along the planned paths of the base", "m/s", 0.1, 1.0, 0.05)] = CRUISE
    false_report: Annotated[bool, Shown(
        "Reported wrongly", "Whether a wrong position of the crate is reported to the controller for a while",
        tries=("false", "true"), name="false report")] = True
    report_offset: Annotated[tuple[float, ...], Range(-10.0, 10.0), Shown(
        "Reported minus true position", "Position of the crate as it is reported, minus its true position, "
        "while the report is wrong", "m", -3.0, 3.0, 0.05)] = (0.0, -1.1, 0.0)
    report_start: Annotated[float, Range(0.0, 1e5), Shown(
        "Wrong from", "Time from which the report is wrong", "s", 0.0, 12.0, 0.5)] = 1.0
    report_end: Annotated[float, Range(0.0, 1e5), Shown(
        "Right again from", "Time from which the report is right again", "s", 0.0, 12.0, 0.5,
        tries=("5", "6", "7", "8", "9"), name="report right again from, s")] = 7.0
    # fmt: on

    def __post_init__(self) -> None:
        """Raises InputError for invalid options."""
        if len(self.report_offset) != 3:
            count = len(self.report_offset)
            raise InputError(f"report_offset has {count} numbers: give x, y and z, e.g. [0, -1.1, 0]")
        check_fields(self)

    @property
    def misreported(self) -> tuple[float, float] | None:
        wrong = self.false_report and self.report_start < self.report_end
        return (self.report_start, self.report_end) if wrong else None

    def reported(self, obstacles: tuple[Obstacle, ...], t: float) -> tuple[Obstacle, ...]:
        # Times are multiples of the control period, except for rounding errors.
        if self.misreported is None or not self.report_start <= t + 1e-9 < self.report_end:
            return obstacles
        return tuple(self._moved(obstacle) for obstacle in obstacles)

    def _moved(self, obstacle: Obstacle) -> Obstacle:
        if isinstance(obstacle, Floor) or obstacle.name != CRATE:
            return obstacle
        x, y, z = (at + off for at, off in zip(obstacle.centre, self.report_offset, strict=True))
        return replace(obstacle, centre=(x, y, z))

    def mission(self, home: Home) -> Mission:
        return self.in_order(
            tuple(MissionTask(role, role, _along(home[role], self.cruise)) for role in ("ee", "base"))
        )


def _along(point: np.ndarray, cruise: float) -> Follow:
    """Returns a straight path along x from a point (m,), m."""
    ahead = np.zeros(len(point))
    ahead[0] = WAY
    return Follow(Path(np.array([point, point + ahead]), cruise, "quintic", 0.0))
