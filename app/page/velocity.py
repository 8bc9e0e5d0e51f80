"""The user interface of a velocity-level scene: goals of hand and base, a mission, two predictions,
obstacles."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import ClassVar

import numpy as np
import viser

from app.client.moment import Moment
from app.html.text import free_name
from app.link.messages import Status, TaskView
from app.panels.run.joints import ACCELERATION, Input
from app.panels.run.plots import PlotsPanel, velocity_plots
from app.panels.velocity.controller import HtmpcPanel, add_servo_plant
from app.panels.velocity.mission import MissionPanel, RolesPanel
from app.panels.velocity.start import BeginPanel
from app.tab.context import PageContext, SessionSnapshot
from app.view.camera import FollowBase
from app.view.drag import TargetFrames
from app.view.goals import Goals
from app.view.obstacles import Obstacles, ReportedObstacles
from app.view.robot import RobotView, look_at
from app.view.surroundings import Carried, People, ReachCircle
from app.view.targets import Movable, full
from app.view.trails import Trails
from himpc.htmpc import base_joints
from lessons.events import Appear, Set
from lessons.settings.velocity import VelocitySettings
from robots.collision import Ball, Box
from robots.reach import horizontal_reach

_AHEAD, _RADIUS = 0.7, 0.2
"""Distance in front of the hand at which a new obstacle appears, and its radius, m."""


class VelocityView:
    """The user interface of a velocity-level scene, a part of `app.page.scene_view.SceneView`. It is built by
    `add_start`, `add_tasks`, `add_control`, `add_plant`, `add_plots`, `more_plots` and `add_scene`, in this
    order. `follow` is called for every frame, `draw` about ten times per second, and `write` a few times per
    second.

    Attributes:
        fastest: the highest useful speed of the simulation, simulated seconds per second.
        input: the input of the joints that is plotted.
        opens_inside: whether the picture of a tick is what the scene is about: its tab then is the first one.
        more_plots: titles of further tabs, each with the function that fills it.
    """

    fastest: ClassVar[float] = 10.0
    input: ClassVar[Input] = ACCELERATION
    opens_inside: ClassVar[bool] = False
    more_plots: ClassVar[tuple[tuple[str, Callable[[], None]], ...]] = ()  # no picture of a tick

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._points = [task for task in page.ready.tasks if task.kind == "position"]
        self._turned = next((task for task in page.ready.tasks if task.kind == "orientation"), None)
        self._base = base_joints(page.ready.robot)

    # ---------------------------------------------------------------- building

    def add_start(self) -> None:
        self._begin = BeginPanel(self._page, bool(self._base), self._look, self._add_obstacle)

    def add_tasks(self, strip: viser.GuiTabHandle | None) -> None:
        """Adds the levels and what stands with them; the rows of the levels also to the tab `strip` of a
        panel over the scene."""
        self._roles = RolesPanel(self._page, strip)
        self._mission = MissionPanel(self._page, lambda: self._goals.places)

    def add_control(self) -> None:
        self._controller = HtmpcPanel(self._page)

    def add_plant(self) -> None:
        add_servo_plant(self._page)

    def add_plots(self) -> None:
        self._plots = PlotsPanel(self._page, velocity_plots)

    def add_scene(self, robot: RobotView) -> None:
        """Adds all objects except the robot and the floor to the 3D view. robot: velocity servos do not react
        to a pull of its links."""
        del robot
        page, scene = self._page, self._page.client.scene
        self._frames = TargetFrames(scene)
        self._obstacles = Obstacles(scene, self._put)
        self._reported = ReportedObstacles(scene)
        self._people = People(scene)
        self._carried = Carried(scene)
        self._goals = Goals(page)
        self._trails = {
            task.name: Trails(scene, [], page.colours[task.level], f"_{task.name}", scale=1)
            for task in self._points
        }
        self._along = FollowBase(page.client.camera)
        self._circle: ReachCircle | None = None
        if self._base:
            first = len(self._base)
            self._circle = ReachCircle(scene, first, horizontal_reach(page.robot, first))

    def recompose(self) -> None:
        """Does nothing: the mission of a velocity-level scene defines its stack, which never changes."""

    # ---------------------------------------------------------------- events out

    def _settings(self) -> VelocitySettings:
        return self._page.settings

    def toggle(self, place: int) -> None:
        """Switches the level at an index (0-based) on or off, if there is such a level."""
        self._roles.toggle(place)

    def _put(self, name: str, centre: tuple[float, float, float]) -> None:
        self._page.post(Set(f"obstacles.{name}", centre))

    def movables(self) -> list[Movable]:
        goals = self._goals.movables()
        taken = {each.name for each in goals}
        return goals + [
            Movable(each.name, partial(np.array, each.centre), partial(self._put_at, each.name))
            for each in self._settings().htmpc.obstacles
            if isinstance(each, (Ball, Box)) and each.name not in taken
        ]

    def _put_at(self, name: str, place: np.ndarray) -> None:
        x, y, z = place.tolist()
        self._put(name, (x, y, z))

    def _add_obstacle(self) -> None:
        """Adds a ball in front of the hand, as seen from the base. The ball is close enough to have an
        effect, but does not block the hand."""
        poses = self._page.poses()
        if poses is None:
            return
        base = poses[len(self._base) - 1, :2] if self._base else np.zeros(2)
        ahead = poses[-1, :2] - base
        ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-6)
        x, y = poses[-1, :2] + _AHEAD * ahead
        taken = [each.name for each in self._settings().htmpc.obstacles]
        name = free_name("ball", taken)
        self._page.post(Appear(name, (float(x), float(y), float(poses[-1, 2])), _RADIUS))

    def _look(self) -> None:
        poses = self._page.poses()
        if poses is not None:
            base = poses[len(self._base) - 1, :3] if self._base else np.zeros(3)
            look_at(self._page.client.camera, self._page.ready.robot, base)

    # ---------------------------------------------------------------- following

    def follow(self, moment: Moment) -> None:
        tip = moment.poses[-1]
        self._frames.actual(tip)
        self._goals.turn(moment.poses, moment.status.targets, moment.live)
        if self._base:
            self._along.follow(moment.poses[len(self._base) - 1, :3], bool(self._begin.along.value))
        mission = moment.status.mission
        carries = mission is not None and bool(mission.people) and not mission.done
        self._carried.follow(tip[:3], carries)

    def _at(self, task: TaskView, poses: np.ndarray) -> np.ndarray:
        """Returns the position of a task's point, (3,) m: the tip, or the base on the floor."""
        if "z" in task.axes or not self._base:
            return poses[-1, :3]
        return np.array([*poses[len(self._base) - 1, :2], 0.01])

    def after_reset(self, status: Status) -> None:
        """Updates the interface after the robot was reset to its start: nothing, as goals stay."""

    def draw(self, moment: Moment) -> None:
        status, latest, settings = moment.status, moment.latest, self._settings()
        fields = self._page.ready.layout.fields
        self._goals.follow(status, latest, fields)
        self._obstacles.show(settings.htmpc.obstacles, bool(self._begin.arrows.value))
        t = float(latest[fields["t"]][0])
        told = settings.options.reported(settings.htmpc.obstacles, t)
        self._reported.show(settings.htmpc.obstacles, told)
        self._frames.show(bool(self._begin.frames.value))
        if self._circle is not None:
            self._circle.show(bool(self._begin.reach.value))
        if status.mission is not None:
            self._people.show(status.mission.people)
        for task in self._points:
            trail = self._trails[task.name]
            trail.show(bool(self._begin.trace.value), bool(self._begin.prediction.value))
            path = np.zeros((0, 3)) if status.mission is None else status.mission.paths.get(task.name)
            way = np.array([self._at(task, poses) for poses in moment.way]).reshape(-1, 3)
            trail.draw(way, np.zeros((0, 3)) if path is None else path, settings.T_s)
        self._draw_desired(latest)
        self._plots.draw(moment.window, moment.beside)

    def _draw_desired(self, latest: np.ndarray) -> None:
        """Draws the present reference of the hand, position and orientation."""
        hand, turned = next((task for task in self._points if "z" in task.axes), None), self._turned
        if hand is not None:
            fields = self._page.ready.layout.fields
            wanted = None if turned is None else latest[fields[f"x_d/{turned.name}"]]
            self._frames.desired(full(hand, latest[fields[f"x_d/{hand.name}"]], np.zeros(3)), wanted)

    def write(self, now: SessionSnapshot[VelocitySettings]) -> None:
        self._begin.update(now)
        self._mission.update(now)
        self._roles.update(now)
        self._controller.update(now)

    def close(self) -> None:
        """Stops all updates, before the scene is removed."""
