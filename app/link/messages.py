"""The messages between the page and its simulation process. All are frozen and picklable."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from app.link.choice import SceneChoice
from app.link.exercise import Lecture, Predict, RunStep

if TYPE_CHECKING:
    from himpc.plan import Binding
    from himpc.telemetry import Layout
    from lessons.events import Event, MoveTarget
    from lessons.geometry.matrix import Matrix
    from lessons.geometry.plane import Plane
    from lessons.settings.settings import SceneSettings
    from robots import Robot
    from robots.world import World


@dataclass(frozen=True)
class MissionRow:
    """A task of a mission. goal: position, m, or quaternion x y z w; None for a trajectory; hold: time to
    stay at the goal, s, None: until released; there_s: time at the goal so far, s; done_at: time at which the
    task was completed, s."""

    name: str
    role: str
    goal: tuple[float, ...] | None
    tolerance: float
    hold: float | None
    state: Literal["done", "active", "ahead"]
    there_s: float | None
    done_at: float | None


@dataclass(frozen=True)
class Person:
    """A person who receives balls. hand: point at which a ball is handed over, m; place: position on the
    floor, m; balls: number of balls received."""

    hand: tuple[float, float, float]
    place: tuple[float, float]
    balls: int


@dataclass(frozen=True, eq=False)
class MissionView:
    """The state of a mission. paths: predicted path per role, (N + 1, 3) m."""

    rows: tuple[MissionRow, ...]
    done: bool
    paths: dict[str, np.ndarray]
    people: tuple[Person, ...]


@dataclass(frozen=True)
class OwnCode:
    """The state of a controller from the user's own file.

    Attributes:
        file: path of the file.
        fault: one sentence if the present content of the file cannot run.
        saves: number of saved versions that took effect.
        at: simulated time at which the last saved version took effect, s.
    """

    file: str
    fault: str | None
    saves: int
    at: float


@dataclass(frozen=True)
class InsideRequest:
    """The internal data of a tick that the page shows; the answer comes with every `Status`.

    plane: the two joints whose increments span the plane of the cut, None: no plane; through: name of
    the level whose solution the plane contains, "" for the applied solution; shift: offset of the
    other joints' increments from that solution, N·m; matrix: name of the level whose QP is shown as a
    picture, None: no picture; spectrum: whether to send the eigenvalues of I − M⁻¹M̄.
    """

    plane: tuple[int, int] | None = None
    through: str = ""
    shift: float = 0.0
    matrix: str | None = None
    spectrum: bool = False


@dataclass(frozen=True, eq=False)
class Inside:
    """The requested internal data of the last tick; see `InsideRequest`.

    why_not: a sentence if there is no tick to show; spectrum: the eigenvalues, (n,).
    """

    plane: Plane | None = None
    matrix: Matrix | None = None
    spectrum: np.ndarray | None = None
    why_not: str = ""


# ------------------------------------------------------------------ page → simulation


@dataclass(frozen=True)
class Post:
    """An event for the session's mailbox, and targets that take effect at the same control tick."""

    event: Event
    also: tuple[MoveTarget, ...] = ()


@dataclass(frozen=True)
class Play:
    """Run (True) or pause."""

    running: bool


@dataclass(frozen=True)
class StepTick:
    """Pause, then run one tick."""


@dataclass(frozen=True)
class Speed:
    """The requested speed: simulated seconds per second."""

    factor: float


@dataclass(frozen=True)
class ResetAll:
    """Reset the scene, settings included, to the state in which it was first loaded."""


@dataclass(frozen=True)
class Load:
    """Load another scene or robot."""

    choice: SceneChoice


@dataclass(frozen=True)
class Lead:
    """Whether a ghost (another process) follows this simulation. When a ghost is switched on, the scene is
    reset and both begin together; `Script` reports describe all later events."""

    on: bool


@dataclass(frozen=True)
class WaitAt:
    """Simulated time, s, beyond which a leader waits for its ghost."""

    until: float


@dataclass(frozen=True, eq=False)
class Begin:
    """The start of a ghost: the leader's scene, and its settings at its last reset."""

    choice: SceneChoice
    settings: SceneSettings


@dataclass(frozen=True, eq=False)
class FollowLeader:
    """A message of the leader to its ghost. own: assignments "PATH=VALUE" on top of the leader's settings;
    they take effect when the script begins again."""

    script: Script
    own: tuple[str, ...]


@dataclass(frozen=True)
class GetRun:
    """Request a description of the run; the answer is `RunDescription`."""


@dataclass(frozen=True)
class Quit:
    """End the process."""


Command = (
    Post
    | Play
    | StepTick
    | Speed
    | ResetAll
    | Load
    | Lead
    | WaitAt
    | FollowLeader
    | GetRun
    | Predict
    | RunStep
    | InsideRequest
    | Quit
)


# ------------------------------------------------------------------ simulation → page


@dataclass(frozen=True, eq=False)
class TaskView:
    """The data of a task that the page needs to draw it.

    kind: a key of himpc.tasks.KINDS; frame: name of a link (tasks on frames only); axes: the controlled axes;
    raw: the raw value of a target that can be dragged, None for other references; path: (k, 3) closed curve
    of a position reference, m; root: the reference link of a relative task; normal, offset: the plane of a
    distance task.
    """

    name: str
    level: str
    kind: str
    unit: str
    frame: str
    axes: str
    raw: np.ndarray | None
    path: np.ndarray | None
    root: str = ""
    normal: tuple[float, ...] = (0.0, 0.0, 1.0)
    offset: float = 0.0


@dataclass(frozen=True)
class ContactPoint:
    """A point at which the robot touches an object or itself. between: two names, first the object or the
    other link, then the link on which the force acts; position, m, and force, N, in the world frame."""

    between: tuple[str, str]
    position: tuple[float, float, float]
    force: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Ready:
    """A scene is loaded and its first tick can run. room: (k, 3) points, m, that the camera should show
    besides the robot; again: the same run continues with another stack; left_out: a sentence for each of the
    user's own tasks that is not offered; world: the objects around the robot."""

    choice: SceneChoice
    block: int  # the open file of the shared memory, see `app.link.process`
    robot: Robot
    layout: Layout
    settings: SceneSettings
    tasks: tuple[TaskView, ...]
    room: np.ndarray
    again: bool = False
    left_out: tuple[str, ...] = ()
    world: World = ()


@dataclass(frozen=True, eq=False)
class Status:
    """Data that need not be sent every tick; sent about ten times a second.

    real_time_factor: simulated over real seconds; capped: simulated time had to be slowed down;
    over_budget: ticks whose control step took longer than T_s; late: ticks that missed their deadline;
    resets: number of resets of the scene (the page then moves its gizmo); targets: raw targets by task;
    path: (N + 1, 3) predicted tip, m; settings: sent only after a change; gauge: norm and spectral radius
    of I − M⁻¹M̄ while paused, when no row of telemetry contains them; mission: only if the scene has a
    mission; lecture: state of a lesson, sent after a change; inside: sent while the page requests it;
    own: state of a controller from a file; ranks: per level the number of available directions, and of
    rows; contacts: the points of contact after the last tick; objects: (k, 7), the poses of the free
    objects; nearest: the names of the nearest pair, "" if no distance is measured; code: the state code of
    the setting, sent after a change, "" if there is none.
    """

    t: float
    ticks: int
    running: bool
    speed: float
    real_time_factor: float
    capped: bool
    over_budget: int
    late: int
    resets: int
    targets: dict[str, np.ndarray]
    path: np.ndarray
    binding: tuple[Binding, ...]
    notices: tuple[str, ...] = ()
    settings: SceneSettings | None = field(default=None)
    gauge: tuple[float, float] | None = None
    mission: MissionView | None = None
    lecture: Lecture | None = None
    inside: Inside | None = None
    own: OwnCode | None = None
    ranks: dict[str, tuple[int, int]] = field(default_factory=dict)
    contacts: tuple[ContactPoint, ...] = ()
    objects: np.ndarray = field(default_factory=lambda: np.zeros((0, 7)))
    nearest: str = ""
    code: str | None = None


@dataclass(frozen=True)
class Loading:
    """The simulation has received the command to load a scene; the next report may come late."""


@dataclass(frozen=True)
class LoadRefused:
    """A scene or robot could not be loaded; the previous scene continues."""

    sentence: str


@dataclass(frozen=True)
class SimulationFailed:
    """The simulation stopped with an exception; `died`: its process ended without sending a report."""

    sentence: str
    died: bool = False


@dataclass(frozen=True, eq=False)
class Script:
    """Data that a leader sends to its ghost.
    events: new events in the leader's log; t: the time that the leader has reached, s; begin: if not None,
    the ghost starts again from this state before it applies the events.
    """

    events: tuple[tuple[float, Event], ...]
    t: float
    begin: Begin | None


@dataclass(frozen=True)
class Reached:
    """The time that a ghost has reached, s."""

    t: float


@dataclass(frozen=True, eq=False)
class RunDescription:
    """A description with which a run can be repeated.
    choice: the scene as it was loaded; settings: the settings in force; log: (time, event) of every event
    that took effect since loading; t: time since the last reset, s.
    """

    choice: SceneChoice
    settings: SceneSettings
    log: tuple[tuple[float, Event], ...]
    t: float


Report = Ready | Loading | Status | LoadRefused | SimulationFailed | Script | Reached | RunDescription
