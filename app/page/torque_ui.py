"""The user interface of a torque-level scene: one draggable target, a stack of levels, M̄, and a dynamic
plant."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import viser

from app.adapter.private import unless_removed
from app.client.moment import Moment
from app.html.palette import LEVELS
from app.link.exercise import signals_of
from app.link.messages import Status
from app.page.scene_ui import Tabs
from app.panels.inside.inside import InsidePanel
from app.panels.run.joints import JointPlots
from app.panels.run.move import MovePanel
from app.panels.torque.controller import ControllerPanel, HorizonPanel
from app.panels.torque.plant import add_plant
from app.panels.torque.plots import LevelPlots
from app.panels.torque.start import StartPanel
from app.panels.torque.tasks import TasksPanel
from app.tab.context import PageContext, SessionSnapshot
from app.view.coordinates import draggable
from app.view.drag import Hand, TargetFrames, paused_words
from app.view.drag_target import Movable
from app.view.ellipsoids import EllipsoidView
from app.view.pull import Pull
from app.view.robot import CoverView, LinkPicker, RobotView, gizmo_size
from app.view.surroundings import ContactView, WorldView
from app.view.targets import Targets
from app.view.trails import Trails
from app.view.turns import JointTurns
from lessons.events import Set
from lessons.settings.torque import TorqueSettings


class TorqueFace:
    """The user interface of a torque-level scene; `app.page.scene_ui.Face` describes its methods."""

    fastest: ClassVar[float] = 1.0

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._inside_tab: viser.GuiTabHandle | None = None
        self._stale: Status | None = None
        """The last report of the previous stack."""

    # ---------------------------------------------------------------- building

    def add_start(self) -> None:
        self._start = StartPanel(self._page)
        self._move = MovePanel(self._page.gui, self._movables)
        self._start.on_recall = self._recall

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

    def open_plots(self, plots: Tabs) -> None:
        if self.opens_inside:
            self._inside_tab = plots.add_tab("Inside")

    def add_plots(self, plots: Tabs, inside: Tabs) -> None:
        page = self._page
        with plots.add_tab("Errors"):
            self._level_plots = LevelPlots(page)
        with plots.add_tab("Joints"):
            self._joint_plots = JointPlots(page)
        with self._inside_tab or inside.add_tab("Inside"):
            self._inside_place = page.gui.add_folder(None)
        self._look_inside()

    def _look_inside(self) -> None:
        page = self._page
        with self._inside_place:
            self._inside_parts = page.gui.add_folder(None)
        with self._inside_parts:
            self._inside = InsidePanel(page, self._horizon.spectrum)

    def recompose(self) -> None:
        page = self._page
        self._stale = page.learner.status
        self._tasks.rebuild()
        self._level_plots.rebuild()
        self._inside_parts.remove()
        self._look_inside()
        self._hand.remove()
        self._targets.remove()
        self._add_targets(page.client.scene)

    def add_scene(self, scene: viser.SceneApi, robot: RobotView) -> None:
        page, ready = self._page, self._page.ready
        tip = self._tip()
        self._frames = TargetFrames(scene)
        self._frames.desired(tip[:3], tip[[4, 5, 6, 3]])  # valid until the first tick is reported
        self._add_targets(scene)
        self._links = LinkPicker(robot, ready.robot, self._tasks.choose)
        self._ellipsoids = EllipsoidView(scene, ready.robot, page.colours)
        self._cover = CoverView(scene, ready.robot)
        exercise = ready.choice.exercise
        asked = exercise is not None and any(
            each.name == "joints moved" for each in signals_of(exercise.part)
        )
        self._turns = JointTurns(scene, ready.robot.joints) if asked else None
        self._world, self._contacts = WorldView(scene, ready.world), ContactView(scene)
        self._pull = Pull(scene, robot, ready.robot, page.post)
        curves = [(task.path, page.colours[task.level]) for task in ready.tasks if task.path is not None]
        position = draggable(ready.tasks)[0]
        self._trails = Trails(scene, curves, LEVELS[0] if position is None else page.colours[position.level])

    def _tip(self) -> np.ndarray:
        return self._page.poses_or_still()[-1]

    def _targets_now(self) -> dict[str, np.ndarray]:
        """Returns the present raw targets, also while a past instant is shown."""
        ready, status = self._page.ready, self._page.learner.status
        targets = {task.name: task.raw for task in ready.tasks if task.raw is not None}
        return targets if status is None or status is self._stale else targets | status.targets

    def _add_targets(self, scene: viser.SceneApi) -> None:
        page, ready = self._page, self._page.ready
        size = gizmo_size(ready.robot)
        self._hand = Hand(
            scene,
            ready,
            self._targets_now(),
            self._tip(),
            size,
            page.post,
            lambda: bool(self._start.clamp.value),
            self._start.dragged,
            page.loop.call_later,
        )
        self._targets = Targets(
            scene,
            ready,
            page.colours,
            page.poses_or_still(),
            0.75 * size,
            page.post,
        )

    # ---------------------------------------------------------------- events out

    def toggle(self, place: int) -> Set | None:
        return self._tasks.toggle(place)

    def _movables(self) -> list[Movable]:
        return [*self._hand.movables(), *self._targets.movables()]

    def _recall(self) -> None:
        poses = self._page.poses()
        if poses is not None:
            self._hand.recall(poses[-1])

    # ---------------------------------------------------------------- following

    def follow(self, moment: Moment) -> None:
        self._frames.actual(moment.poses[-1])
        self._targets.follow(moment.poses, moment.status.targets, moment.live)
        self._links.follow(self._tasks.picking)
        self._world.follow(moment.status.objects)
        self._contacts.show(moment.status.contacts)
        if moment.live:
            self._hand.follow(moment.status.targets)
        running = moment.live and moment.status.running
        self._pull.follow(moment.poses, self._page.settings.plant, running, bool(self._start.pull.value))

    def after_reset(self, status: Status) -> None:
        self._hand.after_reset(status.targets)

    def draw(self, moment: Moment) -> None:
        page, T_s = self._page, self._page.settings.T_s
        self._frames.show(bool(self._start.frames.value))
        self._trails.show(bool(self._start.trace.value), bool(self._start.prediction.value))
        moves = moment.status.running or not moment.live
        paused = "" if moves else paused_words(page.learner.lecture_of(page.ready))
        self._hand.show(self._frames, page.settings, moment.latest, page.ready.layout.fields, paused)
        self._hand.look_back(None if moment.live else moment.status.targets)
        tips = moment.way[:, -1, :3] if len(moment.way) else np.zeros((0, 3))
        self._trails.draw(tips, moment.status.path, T_s)
        beside = None if moment.ghost is None else moment.ghost.window
        self._level_plots.draw(moment.window, beside)
        self._joint_plots.draw(moment.window, beside)
        self._inside.draw(moment)
        q = moment.latest[page.ready.layout.fields["q"]]
        if self._turns is not None:
            self._turns.draw(moment.t, q, moment.poses, moment.window)
        self._ellipsoids.draw(bool(self._start.ellipsoids.value), q, page.settings.levels)
        self._cover.draw(bool(self._start.cover.value))

    def write(self, now: SessionSnapshot[TorqueSettings]) -> None:
        if now.status.gauge is not None:
            fields = now.ready.layout.fields
            # The snapshot's row is a copy, which may be changed.
            now.latest[fields["gauge_norm"]], now.latest[fields["gauge_radius"]] = now.status.gauge
        self._start.show_verdict(self._hand.verdict, bool(self._start.clamp.value))
        self._start.update(now)
        self._page.loop.call_soon_threadsafe(unless_removed, self._move.update)
        self._tasks.update(now)
        self._controller.update(now)
        self._horizon.update(now)
        self._inside.write(now.status, now.settings)

    def close(self) -> None:
        self._tasks.close()
        self._hand.close()
