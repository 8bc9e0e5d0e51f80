"""What one scene looks like in one page: the 3D view, the panels, and how they follow the session."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

import numpy as np
import viser

from app.hand import Hand
from app.learner import Learner
from app.messages import Post, Ready, SceneChoice
from app.palette import LEVELS, level_colours
from app.panels.bind import Bindings
from app.panels.binding import BindingPanel
from app.panels.controller import ControllerPanel
from app.panels.help import HelpPanel
from app.panels.joints import JointPlots
from app.panels.plant import PlantPanel
from app.panels.playback import PlaybackPanel
from app.panels.plots import LevelPlots
from app.panels.robot import RobotPanel
from app.panels.snapshot import Snapshot
from app.panels.start import StartPanel
from app.panels.tasks import TasksPanel
from app.text import PHONE
from app.view.coordinates import draggable, in_order
from app.view.robot import RobotView, camera_for
from app.view.target import Frames
from app.view.trails import Trails
from lessons.events import Event
from lessons.settings import SceneSettings

_HOTKEYS = ("1", "2", "3", "4", "5", "6", "7", "8", "9")


class Stage:
    """Built once per scene. `follow` is called by the page's loop; callbacks only post."""

    def __init__(
        self,
        client: viser.ClientHandle,
        learner: Learner,
        ready: Ready,
        scenes: Mapping[str, str],
        dark: bool,
        choose: Callable[[SceneChoice], None],
        theme: Callable[[bool], None],
        by_path: bool,
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        self._client, self._learner, self._ready = client, learner, ready
        self._theme, self._dark = theme, dark
        self._colours = level_colours([task.level for task in in_order(ready)])
        self._resets: int | None = None
        self._T_s = ready.settings.T_s
        self._build_panels(client.gui, scenes, choose, by_path, loop)
        self._build_scene(client)

    # ---------------------------------------------------------------- building

    def _build_panels(
        self,
        gui: viser.GuiApi,
        scenes: Mapping[str, str],
        choose: Callable[[SceneChoice], None],
        by_path: bool,
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        ready, settings = self._ready, self._learner.settings or self._ready.settings
        by_hand = any(task.kind == "position" and task.raw is not None for task in ready.tasks)
        gui.add_html(PHONE)
        self._bindings = Bindings(self._post, loop)
        self._playback = PlaybackPanel(gui, self._learner, loop)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Start"):
            self._start = StartPanel(gui, self._post, ready.robot.joint_names, by_hand, self._dark)
        with tabs.add_tab("Tasks"):
            self._tasks = TasksPanel(gui, self._bindings, settings, self._colours, self._settings)
        with tabs.add_tab("Control"):
            self._controller = ControllerPanel(gui, self._bindings, settings, ready.robot)
        with tabs.add_tab("Plant"):
            PlantPanel(gui, self._bindings, settings, ready.robot)
        with tabs.add_tab("Robot"):
            self._robot_panel = RobotPanel(gui, ready, scenes, choose, by_path)
        with tabs.add_tab("Help"):
            HelpPanel(gui)
        self._start.on_theme = self._change_theme
        self._start.on_recall = self._recall
        for place, key in enumerate(_HOTKEYS[: len(settings.levels)]):
            self._level_hotkey(gui, place, key)
        plots = gui.add_panel()
        with plots.add_tab("Errors"):
            self._level_plots = LevelPlots(gui, ready, self._colours)
        with plots.add_tab("Joints"):
            self._joint_plots = JointPlots(gui, ready.robot)
        with plots.add_tab("Who binds"):
            self._binding = BindingPanel(gui, self._colours)
        plots.dock_left()
        plots.set_width(400)

    def _level_hotkey(self, gui: viser.GuiApi, place: int, key: str) -> None:
        command = gui.add_command(f"Level {place + 1} on or off", hotkey=key)  # pyright: ignore[reportArgumentType]

        @command.on_trigger
        async def _(_: object) -> None:
            event = self._tasks.toggle(place)
            if event is not None:
                self._post(event)

    def _build_scene(self, client: viser.ClientHandle) -> None:
        ready, scene = self._ready, client.scene
        reach = camera_for(ready.robot)[2]
        # Shadows triple the cost of a frame, which decides on a laptop or a phone.
        scene.configure_default_lights(cast_shadow=False)
        self._floor = scene.add_grid("/floor", width=4.0, height=4.0, cell_size=0.1, section_size=0.5)
        self._paint_floor(self._dark)
        self._robot = RobotView(scene, ready.robot)
        poses = self._learner.read(lambda block, _: block.poses())
        tip = np.array([0, 0, 0, 1.0, 0, 0, 0]) if poses is None else poses[-1]
        self._frames = Frames(scene)
        position = draggable(ready.tasks)[0]
        self._hand = Hand(
            scene,
            ready,
            self._colours,
            {} if self._learner.status is None else self._learner.status.targets,
            tip,
            float(np.clip(0.2 * reach, 0.12, 0.4)),
            self._post,
            lambda: bool(self._start.clamp.value),
            self._start.dragged,
        )
        curves = [
            (task.path, self._colours[task.level])
            for task in ready.tasks
            if task.kind == "position" and task.path is not None
        ]
        self._trails = Trails(scene, curves, LEVELS[0] if position is None else self._colours[position.level])

    def _change_theme(self, dark: bool) -> None:
        self._theme(dark)
        self._paint_floor(dark)

    def _paint_floor(self, dark: bool) -> None:
        """Lines that stay behind the robot, whatever the background."""
        cell, section = (70, 105) if dark else (215, 175)
        self._floor.cell_color = (cell, cell, cell)
        self._floor.section_color = (section, section, section)

    # ---------------------------------------------------------------- events out

    def _settings(self) -> SceneSettings:
        return self._learner.settings or self._ready.settings

    def _post(self, event: Event) -> None:
        self._learner.send(Post(event))

    def _recall(self) -> None:
        poses = self._learner.read(lambda block, _: block.poses())
        if poses is not None:
            self._hand.recall(poses[-1])

    # ---------------------------------------------------------------- following

    def refuse(self, sentence: str) -> None:
        self._robot_panel.refuse(sentence)

    def show_failure(self, sentence: str | None) -> None:
        self._playback.show_failure(sentence)

    def follow(self, plots: bool, texts: bool) -> None:
        """Shows the newest poses, and now and then plots and texts."""
        learner = self._learner
        found = learner.read(lambda block, history: (block.poses(), history.pull()))
        if found is None:
            return
        poses, _ = found
        with self._client.atomic():
            self._robot.move(poses[:-1])
            self._frames.actual(poses[-1])
        if learner.failure is not None or learner.status is None:
            return
        status, settings = learner.status, self._settings()
        if settings.T_s != self._T_s:
            self._T_s = settings.T_s
            learner.new_time_step(self._T_s)
        if status.resets != self._resets:
            self._after_reset(first=self._resets is None)
            self._resets = status.resets
        self._trails.add(status.t, poses[-1, :3])
        if plots:
            self._draw()
        if texts:
            self._write()

    def _after_reset(self, first: bool) -> None:
        status = self._learner.status
        assert status is not None
        self._trails.clear()
        if first:
            return
        self._learner.read(lambda _, history: history.forget())
        self._hand.after_reset(status.targets)

    def _draw(self) -> None:
        learner, settings = self._learner, self._settings()
        status = learner.status
        assert status is not None
        with self._client.atomic():
            self._show()
            self._trails.draw(status.path, settings.T_s)
            learner.read(lambda _, history: self._level_plots.draw(history, settings.T_s))
            learner.read(lambda _, history: self._joint_plots.draw(history, settings.T_s))

    def _show(self) -> None:
        self._frames.show(bool(self._start.frames.value))
        self._trails.show(bool(self._start.trace.value), bool(self._start.prediction.value))
        latest = self._learner.read(lambda _, history: history.latest)
        self._hand.show(self._frames, self._settings(), latest, self._ready.layout.fields)

    def _write(self) -> None:
        learner, settings = self._learner, self._settings()
        found = learner.read(lambda _, history: (history.latest, history.bound_ticks.copy(), history.count))
        if found is None or learner.status is None or found[2] == 0:
            return
        latest = found[0]
        if learner.status.gauge is not None:
            fields = self._ready.layout.fields
            latest = latest.copy()
            latest[fields["gauge_norm"]], latest[fields["gauge_radius"]] = learner.status.gauge
        now = Snapshot(self._ready, settings, learner.status, latest, found[1] * settings.T_s)
        with self._client.atomic():
            self._playback.update(now)
            self._start.show_verdict(self._hand.verdict, bool(self._start.clamp.value))
            self._tasks.update(now)
            self._controller.update(now)
            self._binding.update(now)
            self._bindings.refresh(settings)

    def close(self) -> None:
        self._bindings.close()
        self._playback.close()
        self._hand.close()
