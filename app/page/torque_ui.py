"""The user interface of a torque-level scene: one draggable target, a stack of levels, M̄, and a dynamic
plant."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
import viser

from app.adapter.removed_handle_errors import unless_removed
from app.client.moment import Moment
from app.html.palette import LEVELS
from app.link.exercise import signals_of
from app.link.messages import Ready, Status
from app.page.scene_ui import Context, Tabs
from app.panels.inside.inside import InsidePanel
from app.panels.run.joints import JointPlots
from app.panels.run.move import MovePanel
from app.panels.torque.controller import ControllerPanel, HorizonPanel
from app.panels.torque.plant import add_plant
from app.panels.torque.plots import LevelPlots
from app.panels.torque.start import StartPanel
from app.panels.torque.tasks import TasksPanel
from app.panels.widgets.snapshot import SessionSnapshot
from app.view.coordinates import draggable
from app.view.drag import Hand, TargetFrames, paused_words
from app.view.drag_target import Movable
from app.view.ellipsoids import EllipsoidView
from app.view.pull import Pull
from app.view.robot import CoverView, LinkPicker, RobotView, gizmo_size
from app.view.targets import Targets
from app.view.trails import Trails
from app.view.turns import JointTurns
from app.view.world import ContactView, WorldView
from lessons.events import Set
from lessons.settings.torque import TorqueSettings


class TorqueFace:
    """The user interface of a torque-level scene; `app.page.scene_ui.Face` describes its methods."""

    fastest: ClassVar[float] = 1.0

    def __init__(self, context: Context) -> None:
        self._context = context
        self._inside_tab: viser.GuiTabHandle | None = None
        self._stale: Status | None = None
        """The last report of the previous stack."""

    # ---------------------------------------------------------------- building

    def add_start(self, gui: viser.GuiApi) -> None:
        context = self._context
        self._start = StartPanel(
            gui, context.post, context.ready, context.settings, context.colours, context.dark
        )
        self._move = MovePanel(gui, self._movables)
        self._start.on_theme = context.theme
        self._start.on_recall = self._recall

    def add_tasks(self, gui: viser.GuiApi, strip: viser.GuiTabHandle | None) -> None:
        context, ready = self._context, self._context.ready
        self._tasks = TasksPanel(
            gui,
            context.bindings,
            context.loop,
            ready.robot,
            context.colours,
            lambda: self._context.settings,
            self._targets_now,
            in_lesson=ready.choice.exercise is not None,
            strip=strip,
        )
        self._horizon = HorizonPanel(
            context.client, context.in_view, context.bindings, context.settings, ready.robot
        )

    def add_control(self, gui: viser.GuiApi) -> None:
        self._controller = ControllerPanel(gui, self._context.bindings, self._context.settings)

    def add_plant(self, gui: viser.GuiApi) -> None:
        add_plant(gui, self._context.bindings, self._context.settings, self._context.ready.robot)

    @property
    def opens_inside(self) -> bool:
        return self._context.settings.horizon == 1  # the QP is small enough for beginners

    def open_plots(self, plots: Tabs) -> None:
        if self.opens_inside:
            self._inside_tab = plots.add_tab("Inside")

    def add_plots(self, gui: viser.GuiApi, plots: Tabs, inside: Tabs) -> None:
        context = self._context
        with plots.add_tab("Errors"):
            self._level_plots = LevelPlots(
                gui, context.in_view, context.ready, context.settings, context.colours
            )
        with plots.add_tab("Joints"):
            self._joint_plots = JointPlots(gui, context.in_view, context.ready.robot)
        with self._inside_tab or inside.add_tab("Inside"):
            self._inside_place = gui.add_folder(None)
        self._look_inside(gui)

    def _look_inside(self, gui: viser.GuiApi) -> None:
        context = self._context
        with self._inside_place:
            self._inside_parts = gui.add_folder(None)
        with self._inside_parts:
            self._inside = InsidePanel(
                context.client,
                context.in_view,
                context.ready,
                context.colours,
                context.post,
                context.learner.send,
                self._horizon.spectrum,
            )

    def recompose(self, ready: Ready) -> None:
        """Updates the interface when the run continues with another stack."""
        context = self._context = replace(self._context, ready=ready)
        self._stale = context.learner.status
        self._tasks.rebuild()
        self._level_plots.rebuild(ready)
        self._inside_parts.remove()
        self._look_inside(context.client.gui)
        self._hand.remove()
        self._targets.remove()
        self._add_targets(context.client.scene)

    def add_scene(self, scene: viser.SceneApi, robot: RobotView) -> None:
        context, ready = self._context, self._context.ready
        tip = self._tip()
        self._frames = TargetFrames(scene)
        self._frames.desired(tip[:3], tip[[4, 5, 6, 3]])  # valid until the first tick is reported
        self._add_targets(scene)
        self._links = LinkPicker(robot, ready.robot, self._tasks.choose)
        self._ellipsoids = EllipsoidView(scene, ready.robot, context.colours)
        self._cover = CoverView(scene, ready.robot)
        exercise = ready.choice.exercise
        asked = exercise is not None and any(
            each.name == "joints moved" for each in signals_of(exercise.part)
        )
        self._turns = JointTurns(scene, ready.robot.joints) if asked else None
        self._world, self._contacts = WorldView(scene, ready.world), ContactView(scene)
        self._pull = Pull(scene, robot, ready.robot, context.post)
        curves = [(task.path, context.colours[task.level]) for task in ready.tasks if task.path is not None]
        position = draggable(ready.tasks)[0]
        self._trails = Trails(
            scene, curves, LEVELS[0] if position is None else context.colours[position.level]
        )

    def _tip(self) -> np.ndarray:
        return self._context.poses_or_still()[-1]

    def _targets_now(self) -> dict[str, np.ndarray]:
        """Returns the present raw targets, also while a past instant is shown."""
        ready, status = self._context.ready, self._context.learner.status
        targets = {task.name: task.raw for task in ready.tasks if task.raw is not None}
        return targets if status is None or status is self._stale else targets | status.targets

    def _add_targets(self, scene: viser.SceneApi) -> None:
        context, ready = self._context, self._context.ready
        size = gizmo_size(ready.robot)
        self._hand = Hand(
            scene,
            ready,
            self._targets_now(),
            self._tip(),
            size,
            context.post,
            lambda: bool(self._start.clamp.value),
            self._start.dragged,
            context.loop.call_later,
        )
        self._targets = Targets(
            scene,
            ready,
            context.colours,
            context.poses_or_still(),
            0.75 * size,
            context.post,
        )

    # ---------------------------------------------------------------- events out

    def toggle(self, place: int) -> Set | None:
        return self._tasks.toggle(place)

    def _movables(self) -> list[Movable]:
        return [*self._hand.movables(), *self._targets.movables()]

    def _recall(self) -> None:
        poses = self._context.poses()
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
        self._pull.follow(moment.poses, self._context.settings.plant, running, bool(self._start.pull.value))

    def after_reset(self, status: Status) -> None:
        self._hand.after_reset(status.targets)

    def draw(self, moment: Moment) -> None:
        context, T_s = self._context, self._context.settings.T_s
        self._frames.show(bool(self._start.frames.value))
        self._trails.show(bool(self._start.trace.value), bool(self._start.prediction.value))
        moves = moment.status.running or not moment.live
        paused = "" if moves else paused_words(context.learner.lecture_of(context.ready))
        self._hand.show(self._frames, context.settings, moment.latest, context.ready.layout.fields, paused)
        self._hand.look_back(None if moment.live else moment.status.targets)
        tips = moment.way[:, -1, :3] if len(moment.way) else np.zeros((0, 3))
        self._trails.draw(tips, moment.status.path, T_s)
        beside = None if moment.ghost is None else moment.ghost.window
        self._level_plots.draw(moment.window, beside, context.settings)
        self._joint_plots.draw(moment.window, beside)
        self._inside.draw(moment)
        q = moment.latest[context.ready.layout.fields["q"]]
        if self._turns is not None:
            self._turns.draw(moment.t, q, moment.poses, moment.window)
        self._ellipsoids.draw(bool(self._start.ellipsoids.value), q, context.settings.levels)
        self._cover.draw(bool(self._start.cover.value))

    def write(self, now: SessionSnapshot[TorqueSettings]) -> None:
        if now.status.gauge is not None:
            fields = now.ready.layout.fields
            # The snapshot's row is a copy, which may be changed.
            now.latest[fields["gauge_norm"]], now.latest[fields["gauge_radius"]] = now.status.gauge
        self._start.show_verdict(self._hand.verdict, bool(self._start.clamp.value))
        self._start.update(now, self._context.colours)
        self._context.loop.call_soon_threadsafe(unless_removed, self._move.update)
        self._tasks.update(now)
        self._controller.update(now)
        self._horizon.update(now)
        self._inside.write(now.status, now.settings)

    def close(self) -> None:
        self._tasks.close()
        self._hand.close()
