"""The user interface of a torque-level scene: one draggable target, a stack of levels, M̄, and a dynamic
plant."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
import viser

from app.client.moment import Moment
from app.html.palette import LEVELS
from app.link.exercise import signals_of
from app.link.messages import Status
from app.panels.inside.inside import InsidePanel
from app.panels.run.joints import TORQUE, Input
from app.panels.run.plots import PlotsPanel, torque_plots
from app.panels.torque.controller import ControllerPanel, HorizonPanel, add_plant
from app.panels.torque.start import StartPanel
from app.panels.torque.tasks import TasksPanel
from app.tab.context import PageContext, SessionSnapshot
from app.view.drag import Hand, TargetFrames, paused_words
from app.view.ellipsoids import EllipsoidView
from app.view.pull import Pull
from app.view.robot import CoverView, JointTurns, LinkPicker, RobotView
from app.view.surroundings import ContactView, WorldView
from app.view.targets import Movable, Targets, draggable
from app.view.trails import Trails
from lessons.settings.torque import TorqueSettings


class TorqueView:
    """The user interface of a torque-level scene. Methods as those of `app.page.velocity.VelocityView`: both
    are parts of `app.page.scene_view.SceneView`."""

    fastest: ClassVar[float] = 1.0
    input: ClassVar[Input] = TORQUE

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._hands: list[Hand] = []
        """The dragged target, if the stack has a target that can be dragged."""
        self._stale: Status | None = None
        """The last report of the previous stack."""

    # ---------------------------------------------------------------- building

    def add_start(self) -> None:
        self._start = StartPanel(self._page, self._recall)

    def add_tasks(self, strip: viser.GuiTabHandle | None) -> None:
        self._tasks = TasksPanel(self._page, self._targets_now, strip)
        self._horizon = HorizonPanel(self._page)

    def add_control(self) -> None:
        self._controller = ControllerPanel(self._page)

    def add_plant(self) -> None:
        add_plant(self._page)

    @property
    def opens_inside(self) -> bool:
        return self._page.settings.horizon == 1  # the QP is small enough for beginners

    def add_plots(self) -> None:
        self._plots = PlotsPanel(self._page, torque_plots)

    @property
    def more_plots(self) -> tuple[tuple[str, Callable[[], None]], ...]:
        return (("Inside", self._add_inside),)

    def _add_inside(self) -> None:
        self._inside_place = self._page.gui.add_folder(None)
        self._look_inside()

    def _look_inside(self) -> None:
        with self._inside_place:
            self._inside_parts = self._page.gui.add_folder(None)
        with self._inside_parts:
            self._inside = InsidePanel(self._page, self._horizon.spectrum)

    def recompose(self) -> None:
        self._stale = self._page.learner.status
        self._tasks.rebuild()
        self._inside_parts.remove()
        self._look_inside()
        for hand in self._hands:
            hand.remove()
        self._targets.remove()
        self._add_targets()

    def add_scene(self, robot: RobotView) -> None:
        page, ready, scene = self._page, self._page.ready, self._page.client.scene
        tip = page.poses_or_still()[-1]
        self._frames = TargetFrames(scene)
        self._frames.desired(tip[:3], tip[[4, 5, 6, 3]])  # valid until the first tick is reported
        exercise = ready.choice.exercise
        asked = exercise is not None and any(
            each.name == "joints moved" for each in signals_of(exercise.part)
        )
        self._turns = JointTurns(scene, ready.robot.joints) if asked else None
        self._add_targets()
        self._links = LinkPicker(robot, ready.robot, self._tasks.choose)
        self._ellipsoids = EllipsoidView(scene, ready.robot, page.colours)
        self._cover = CoverView(scene, ready.robot)
        self._world, self._contacts = WorldView(scene, ready.world), ContactView(scene)
        self._pull = Pull(scene, robot, ready.robot, page.post)
        curves = [(task.path, page.colours[task.level]) for task in ready.tasks if task.path is not None]
        target = draggable(ready.tasks)
        colour = LEVELS[0] if target is None else page.colours[target.position.level]
        self._trails = Trails(scene, curves, colour)

    def _targets_now(self) -> dict[str, np.ndarray]:
        """Returns the present raw targets, also while a past instant is shown."""
        ready, status = self._page.ready, self._page.learner.status
        targets = {task.name: task.raw for task in ready.tasks if task.raw is not None}
        return targets if status is None or status is self._stale else targets | status.targets

    def _add_targets(self) -> None:
        page, tasks = self._page, self._page.ready.tasks
        target = draggable(tasks)
        self._hands = []
        if target is not None:
            alone = self._turns is None  # labels of joints are near the target
            self._hands = [Hand(page, target, self._targets_now(), self._start.clamp, invites=alone)]
        self._targets = Targets(page, tasks, page.post)

    # ---------------------------------------------------------------- events out

    def toggle(self, place: int) -> None:
        self._tasks.toggle(place)

    def movables(self) -> list[Movable]:
        return [*(each for hand in self._hands for each in hand.movables()), *self._targets.movables()]

    def _recall(self) -> None:
        poses = self._page.poses()
        if poses is not None:
            for hand in self._hands:
                hand.recall(poses[-1])

    # ---------------------------------------------------------------- following

    def follow(self, moment: Moment) -> None:
        self._frames.actual(moment.poses[-1])
        self._targets.follow(moment.poses, moment.status.targets, moment.live)
        self._links.follow(self._tasks.picking)
        self._world.follow(moment.status.objects)
        self._contacts.show(moment.status.contacts)
        for hand in self._hands if moment.live else ():
            hand.follow(moment.status.targets)
        running = moment.live and moment.status.running
        self._pull.follow(moment.poses, self._page.settings.plant, running, bool(self._start.pull.value))

    def after_reset(self, status: Status) -> None:
        for hand in self._hands:
            hand.after_reset(status.targets)

    def draw(self, moment: Moment) -> None:
        page, start = self._page, self._start
        self._frames.show(bool(start.frames.value))
        self._trails.show(bool(start.trace.value), bool(start.prediction.value))
        moves = moment.status.running or not moment.live
        paused = "" if moves else paused_words(page.learner.lecture_of(page.ready))
        for hand in self._hands:
            hand.show(self._frames, moment.latest, paused)
            hand.look_back(None if moment.live else moment.status.targets)
        tips = moment.way[:, -1, :3] if len(moment.way) else np.zeros((0, 3))
        self._trails.draw(tips, moment.status.path, page.settings.T_s)
        self._plots.draw(moment.window, moment.beside)
        self._inside.draw(moment)
        q = moment.latest[page.ready.layout.fields["q"]]
        if self._turns is not None:
            self._turns.draw(moment.t, q, moment.poses, moment.window)
        self._ellipsoids.draw(bool(start.ellipsoids.value), q, page.settings.levels)
        self._cover.draw(bool(start.cover.value))

    def write(self, now: SessionSnapshot[TorqueSettings]) -> None:
        if now.status.gauge is not None:
            fields = now.ready.layout.fields
            # The snapshot's row is a copy, which may be changed.
            now.latest[fields["gauge_norm"]], now.latest[fields["gauge_radius"]] = now.status.gauge
        verdict = next((hand.verdict for hand in self._hands), None)
        self._start.show_verdict(verdict, bool(self._start.clamp.value))
        self._start.update(now)
        self._tasks.update(now)
        self._controller.update(now)
        self._horizon.update(now)
        self._inside.write(now.status, now.settings)

    def close(self) -> None:
        self._tasks.close()
        for hand in self._hands:
            hand.close()
