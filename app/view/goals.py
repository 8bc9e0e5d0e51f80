"""The goals in a scene with a mission: one per role, and the events that are posted when a goal is moved."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import viser

from app.html.text import free_name, quantity
from app.link.messages import MissionRow, Status, TaskView
from app.tab.context import PageContext
from app.view.robot import gizmo_size
from app.view.targets import Gap, Handle, Movable, Targets, put
from lessons.events import Event, InsertTask, MoveTarget

_BALL = 0.07  # m
_DISC = 0.22  # m
_GAP = 0.03  # m: shorter lines to the goal are not drawn
_LIFT = 0.01  # m above the floor
_THERE = 5e-3
"""Distance, m, below which a point has reached its goal."""


class Goal:
    """A ball, or a disc for a goal on the floor; a line from the controlled point; a label; and, if the goal
    can be dragged, arrows along the world's axes."""

    def __init__(
        self, page: PageContext, task: TaskView, moved: Callable[[TaskView, np.ndarray], None]
    ) -> None:
        """task: of the role; a goal without a raw target cannot be dragged; moved: called with the task and
        the goal (3,), m, after each move."""
        scene, role, colour = page.client.scene, task.name, page.colours[task.level]
        floor = "z" not in task.axes
        size = gizmo_size(page.robot) * (2 if floor else 1)
        self._lift = np.array([0.0, 0.0, _LIFT if floor else 0.0])
        node = f"/goal/{role}"
        position = (np.zeros(3) if task.raw is None else point(task.raw)) + self._lift
        self.handle = None if task.raw is None else Handle(scene, node, task.axes, size, position=position)
        self._node: viser.SceneNodeHandle = (
            scene.add_frame(node, show_axes=False, position=position)
            if self.handle is None
            else self.handle.control
        )
        if floor:
            scene.add_cylinder(f"{node}/disc", radius=_DISC, height=0.015, color=colour, opacity=0.6)
        else:
            scene.add_icosphere(f"{node}/ball", radius=_BALL, color=colour, opacity=0.8)
        self._label = scene.add_label(
            f"{node}/label", role, position=(0.0, 0.0, 0.9 * size + 0.06), anchor="bottom-center"
        )
        self._gap = Gap(scene, f"/gap/{role}", colour, 0.008, _GAP)
        if self.handle is not None:
            self.handle.listen(lambda: moved(task, self.place()))

    def place(self) -> np.ndarray:
        """Returns the position of the goal, (3,) m."""
        return np.array(self._node.position, float) - self._lift

    def follow(self, goal: np.ndarray | None, text: str) -> None:
        """Updates the goal and its label. goal: the session's goal, (3,) m; None if the session has no goal;
        the goal then stays at the position to which it was dragged."""
        self._label.text = text
        if goal is not None and not (self.handle is not None and self.handle.held):
            put(self._node, goal + self._lift)

    def reach_from(self, point: np.ndarray) -> None:
        """Draws the line from the controlled point (3,), m, to the goal."""
        self._gap.show(point + self._lift, self.place() + self._lift)


def point(values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Returns a point in space from the coordinates of a hand (3) or of a base on the floor (2), m."""
    return np.array([*values, 0.0][:3], float)


def open_row(rows: Sequence[MissionRow], role: str) -> MissionRow | None:
    """Returns the first task of a role that is not completed."""
    return next((row for row in rows if row.role == role and row.state != "done"), None)


class Goals:
    """One goal for each position role, and rings at the robot's hand for each orientation role. A goal on a
    predefined trajectory cannot be dragged and shows the present reference of its point."""

    def __init__(self, page: PageContext) -> None:
        self._page, tasks = page, page.ready.tasks
        self._roles = {task.name: task for task in tasks if task.kind == "position"}
        self._given = frozenset(name for name, task in self._roles.items() if task.raw is None)
        self._goals = {name: Goal(page, task, self._moved) for name, task in self._roles.items()}
        self._asked: dict[str, str] = {}
        turning = tuple(task for task in tasks if task.kind == "orientation")
        self._rings = Targets(page, turning, self._turned)

    def _moved(self, task: TaskView, place: np.ndarray) -> None:
        """Moves the goal of the role's first open task; if there is no open task, adds a task that holds the
        point there."""
        rows = self._page.mission_rows
        if rows is None:
            return
        self._page.dragged = True
        goal = tuple(float(place["xyz".index(axis)]) for axis in task.axes)
        row, names = open_row(rows, task.name), [each.name for each in rows]
        asked = self._asked.get(task.name)
        if row is not None:
            self._page.post(MoveTarget(row.name, goal))
        elif asked is not None and asked not in names:
            self._page.post(MoveTarget(asked, goal))  # the session has not answered yet
        else:
            name = self._asked[task.name] = free_name(f"{task.name} by hand", names)
            self._page.post(InsertTask(name, task.name, goal, hold=None))

    def _turned(self, event: Event) -> None:
        """Changes the orientation of the role's open task."""
        assert isinstance(event, MoveTarget)
        row = open_row(self._page.mission_rows or (), event.task)
        if row is not None:
            self._page.dragged = True
            self._page.post(MoveTarget(row.name, event.value))

    def turn(self, poses: np.ndarray, targets: dict[str, np.ndarray], live: bool) -> None:
        """Moves the rings along with the hand; arguments as for `app.view.targets.Targets.follow`."""
        self._rings.follow(poses, targets, live)

    def follow(self, status: Status, latest: np.ndarray, fields: dict[str, slice]) -> None:
        """Updates goals and lines from a new status and the newest row of telemetry."""
        rows = () if status.mission is None else status.mission.rows
        for name, goal in self._goals.items():
            row, target = open_row(rows, name), status.targets.get(name)
            text = f"{name}: done" if row is None else row.name
            at, wanted = latest[fields[f"x/{name}"]], latest[fields[f"x_d/{name}"]]
            if target is None and name in self._given and np.isfinite(wanted).all():
                target = wanted
            if target is not None and np.isfinite(at).all():
                goal.reach_from(point(at))
                away = float(np.linalg.norm(at - target))
                if away > _THERE:
                    text += f": {quantity(away, 'm')} to go"
            goal.follow(None if target is None else point(target), text)

    def movables(self) -> list[Movable]:
        """Returns the goals, which can be moved without a mouse: positions first, then orientations."""
        goals = self._goals.items()
        return [
            *(
                Movable(name, goal.place, goal.handle.move_to)
                for name, goal in goals
                if goal.handle is not None
            ),
            *self._rings.movables(),
        ]

    @property
    def places(self) -> dict[str, np.ndarray]:
        """The position at which each goal is drawn, (3,) m."""
        return {name: goal.place() for name, goal in self._goals.items()}
