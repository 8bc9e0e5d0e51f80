"""The view of one scene in one page: the 3D view, the panels, and their updates from the session."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import viser

from app.adapter.names import CHART_BOX, CHECKBOX, FLOATING_PANEL, ROW, SHEET
from app.adapter.private import unless_removed
from app.client.moment import Moment, moment_of
from app.client.simulation import Trouble
from app.client.simulation_client import GhostClient
from app.html.palette import recoloured
from app.link.messages import Ready
from app.page.torque import TorqueView
from app.page.velocity import VelocityView
from app.panels.lesson.step import Course
from app.panels.run.compare import ComparePanel
from app.panels.run.export import ExportPanel, SharePanel, add_hand_in
from app.panels.run.help import HelpPanel
from app.panels.run.joints import JointPlots
from app.panels.run.move import MovePanel
from app.panels.run.playback import PlaybackPanel, TimeLine
from app.panels.run.plots import BindingPanel
from app.panels.run.scene import RobotPanel
from app.panels.widgets.command import add_command
from app.tab.context import PageContext, SessionSnapshot
from app.view.robot import GhostView, RobotView
from app.view.surroundings import Ground
from app.view.targets import in_order
from lessons.settings.settings import SceneSettings
from lessons.settings.torque import TorqueSettings
from lessons.settings.velocity import VelocitySettings

_PHONE = f"<style>@media (max-width: 36em) {{ {SHEET} {{ width: 100vw !important }} }}</style>"
"""Makes viser's bottom sheet on a phone as wide as the screen; by default the sheet is narrower, with an
empty strip beside it. The style applies while an HTML element that contains it is shown."""
_CHARTS = f"""<style>
div:has(> div > {CHART_BOX}) {{ display: flex; flex-wrap: wrap }}
div:has(> div > {CHART_BOX}) > * {{ flex: 1 1 100%; min-width: 0 }}
div:has(> div > {CHART_BOX}) > div:has(> {CHART_BOX}) {{ flex: 1 1 17em }}
</style>"""
"""Puts charts beside each other where a panel is wide enough; viser puts all controls below each other."""
_SWITCHES = (
    f"<style>{ROW}:has({CHECKBOX}) > :first-child {{ width: auto !important; min-width: 6.6em }}</style>"
)
"""Leaves the name of a checkbox on one line; viser gives names a third of the panel."""
_LOW = 600  # px: in a lower window the levels would cover the robot, and begin folded
_HEAD, _ROW = 45.0, 53.0  # px: heights of the head of a panel over the scene, and of a level in it
_ROOMY = 1100, 720  # px: in a window of this width and height, the plots stand in a row below the robot
_PLOTS, _GAP = 316.0, 8.0  # px: height of the row of plots, and its distance from the edges of the scene
_SIDE = 400.0  # px: width of a docked panel
_FITS = f"<style>{FLOATING_PANEL} {{ max-width: calc(100vw - {_SIDE + 2.0 * _GAP:g}px) }}</style>"
"""Keeps a wide panel over the scene off the docked panel when the window becomes narrower."""
_HOTKEYS = ("1", "2", "3", "4", "5", "6", "7", "8", "9")
_VIEWS: dict[type[SceneSettings], type[TorqueView | VelocityView]] = {
    TorqueSettings: TorqueView,
    VelocitySettings: VelocityView,
}


class SceneView:
    """The view of one scene, built once per scene. The page's loop calls `follow`; callbacks only post
    events."""

    def __init__(self, page: PageContext, narrow: bool) -> None:
        """narrow: whether the page, for example on a phone, has no room for a second panel. The plots
        are then tabs of the right panel."""
        self.page, self._client, self._learner = page, page.client, page.learner
        self._comfort = page.visitor.comfort
        self._level = view_of(page)
        self.shown: tuple[object, ...] | None = None
        """Identifies the instant that was shown last; None before the first instant."""
        self.covered = 0.0, 0.0
        """The heights that panels cover of the scene, from above and from below, px."""
        self._row: viser.PanelHandle | None = None
        """The row of plots below the robot if it is folded while a step of a lesson has no curves."""
        self._has_curves = False
        self._resets: int | None = None
        self._ghost: GhostView | None = None
        self._shown_ghost: GhostClient | None = None
        self._build_panels(page.gui, narrow)
        self._build_scene(page.client.scene)

    # ---------------------------------------------------------------- building

    def _build_panels(self, gui: viser.GuiApi, narrow: bool) -> None:
        gui.add_html(_PHONE + _CHARTS + _SWITCHES)
        exercise = self._learner.choice_of(self.page.ready).exercise
        # On a phone, time and speed come after the question.
        with gui.add_folder(None, order=math.inf if narrow else -1.0):
            brief = exercise is not None
            self._playback = PlaybackPanel(self.page, self._level.fastest, brief)
            self._time_line = TimeLine(self.page)
        tabs = gui.add_tab_group(order=0.0)
        learn, tasks = tabs.add_tab("Learn"), tabs.add_tab("Tasks")
        places = [] if narrow else [tabs.add_tab("Control"), tabs.add_tab("Robot")]
        with tabs.add_tab("More"):
            more = gui.add_tab_group()
        control, robot = places or [more.add_tab("Control"), more.add_tab("Robot")]
        plots = more if narrow else gui.add_panel()
        width, height = self._comfort.window or (0, 0)
        roomy = width >= _ROOMY[0] and height >= _ROOMY[1] and not self._level.opens_inside
        inside = plots.add_tab("Inside") if self._level.opens_inside and not narrow else None
        with learn:
            self._course = Course(self.page, None if narrow else plots)
        with learn if exercise is None else robot:
            self._level.add_start()
            self._move = MovePanel(gui, self._level.movables)
        # The levels also stand over the scene, so that a learner who reads can see and swap them.
        strip = None if narrow else gui.add_panel()
        with tasks:
            self._level.add_tasks(None if strip is None else strip.add_tab("Levels"))
        with control:
            self._level.add_control()
        with robot:
            self._robot_panel = RobotPanel(self.page)
            with gui.add_folder("Plant", expand_by_default=False):
                self._level.add_plant()
        with more.add_tab("Compare"):
            self._compare = ComparePanel(self.page)
        with more.add_tab("Export"):
            ExportPanel(self.page)
            SharePanel(self.page)
            add_hand_in(self.page)
        with more.add_tab("Help"):
            self._comfort.add_switch(gui)
            self._help = HelpPanel(gui)
        for place, key in enumerate(_HOTKEYS):  # hotkeys also for levels that may be added later
            add_command(gui, f"Level {place + 1} on or off", key, partial(self._level.toggle, place))
        with plots.add_tab("Errors"):
            self._level.add_plots()
        with plots.add_tab("Joints"):
            self._joint_plots = JointPlots(self.page, self._level.input)
        for title, add in self._level.more_plots:
            with inside or (more if roomy else plots).add_tab(title):
                add()
        with plots.add_tab("Who binds"):
            self._binding = BindingPanel(self.page)
        above = below = 0.0
        if strip is not None:
            strip.float(x=_GAP, y=_GAP, width=320.0)
            low = self._comfort.window is not None and height < _LOW
            if low or exercise is not None:  # a lesson shows little at once
                strip.minimize()
            else:
                above = _HEAD + _ROW * len({task.level for task in in_order(self.page.ready)})
        if isinstance(plots, viser.PanelHandle):
            if roomy:
                # The scene is so wide that the panel of levels stands beside the robot.
                above, below = 0.0, _PLOTS + _GAP
                gui.add_html(_FITS)
                plots.float(x=_GAP, y=-_GAP, width=width - _SIDE - 2.0 * _GAP, height=_PLOTS)
                if exercise is not None:
                    self._row = plots
                    plots.minimize()
            else:
                plots.dock_left()
                plots.set_width(_SIDE)
        self.covered = above, below

    def _build_scene(self, scene: viser.SceneApi) -> None:
        scene.configure_default_lights(cast_shadow=False)
        self._ground = Ground(scene, self.page.robot, self.page.ready.room)
        self._robot = RobotView(scene, self.page.robot)
        self._level.add_scene(self._robot)

    def recompose(self, ready: Ready) -> None:
        """Rebuilds the controls and plots of levels and tasks when the run continues with another stack."""
        self.page.ready = ready
        colours = recoloured([task.level for task in in_order(ready)], self.page.colours)
        self.page.colours.clear()
        self.page.colours.update(colours)
        self._level.recompose()

    # ---------------------------------------------------------------- following

    def refuse(self, sentence: str) -> bool:
        """Shows a refusal in the panel that made the request; returns whether there was such a panel."""
        return self._robot_panel.refuse(sentence)

    def show_trouble(self, trouble: Trouble | None) -> None:
        self._playback.show_trouble(trouble)

    def follow(self, plots: bool, texts: bool) -> None:
        """Shows the newest poses. Also updates the plots if `plots` is true, and the texts if `texts` is
        true. A page in a hidden tab gets only texts. While a browser has not received the last
        messages, this method is not called."""
        learner = self._learner
        if learner.status is not None:
            self._time_line.update(learner.status.running)
        due, plots = plots, plots and not self.page.in_view.asleep
        moment = moment_of(learner, self._time_line.past, curves=due)
        if moment is None or learner.ready is not self.page.ready:
            return  # there is no report yet, or it belongs to another scene, which the page will build
        self.shown = moment.t, moment.live, learner.status.running if learner.status else None, learner.ghost
        if not self.page.in_view.asleep:
            self._draw(moment, plots)
        if texts and learner.failure is None:
            self._write(moment)

    def _draw(self, moment: Moment, plots: bool) -> None:
        learner = self._learner
        with self._client.atomic():
            self._ground.paint(self._comfort.dark)
            self._ground.move(moment.poses)
            self._robot.move(moment.poses[:-1])
            self._show_ghost(moment)
            if learner.failure is not None:
                return
            if moment.live and moment.status.resets != self._resets:
                if self._resets is not None:
                    self._level.after_reset(moment.status)
                self._resets = moment.status.resets
            self._level.follow(moment)
            if plots:
                self._level.draw(moment)
                self._joint_plots.draw(moment.window, moment.beside)
                if self._ghost is not None and moment.ghost is not None:
                    self._ghost.draw(moment.ghost)

    def _show_ghost(self, moment: Moment) -> None:
        ghost = self._learner.ghost
        if self._ghost is not None and (moment.ghost is None or ghost is not self._shown_ghost):
            self._ghost.remove()
            self._ghost = None
        if moment.ghost is None or ghost is None:
            return
        if self._ghost is None:
            self._ghost = GhostView(self._client.scene, self.page.ready.robot, ghost.words)
            self._shown_ghost = ghost
        self._ghost.move(moment.ghost)

    def _write(self, moment: Moment) -> None:
        learner, settings = self._learner, self.page.settings
        bound_ticks = learner.read(lambda recording: recording.bound_ticks.copy())
        if bound_ticks is None or learner.status is None:
            return
        shown = SessionSnapshot(
            self.page.ready, settings, moment.status, moment.latest.copy(), bound_ticks * settings.T_s
        )
        now = replace(shown, status=learner.status)
        with self._client.atomic():
            self._playback.update(now)
            self._comfort.follow(now.facts())
            if np.isfinite(shown.number("t")):  # since the first row
                self._compare.update(now)
                self._level.write(shown)
                self.page.loop.call_soon_threadsafe(unless_removed, self._move.update)
                self._binding.update(shown)
            lecture = learner.lecture_of(self.page.ready)
            self._course.follow(lecture, settings)
            self._fold_row(lecture is None or not lecture.curves)
            self.page.bindings.refresh(settings)

    def _fold_row(self, empty: bool) -> None:
        """Folds the row of plots when a step without curves opens, and unfolds it when curves begin. Between
        these two the learner's choice stays."""
        if self._row is None or self._has_curves != empty:
            return
        self._has_curves = not empty
        if empty:
            self._row.minimize()
        else:
            self._row.expand()

    def close(self) -> None:
        self._course.close()
        self._help.close()
        self.page.bindings.close()
        self._playback.close()
        self._time_line.close()
        self._level.close()


def view_of(page: PageContext) -> TorqueView | VelocityView:
    return _VIEWS[type(page.ready.settings)](page)
