"""The headless loop of a velocity-level scene: mission → window → controller → plant."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np

from himpc.htmpc import HTMPCSettings, VelocityPlan, base_joints, bounds
from himpc.kinematics.configuration import Configuration
from himpc.missions import Progress, advanced, insert, move, release, remove, reorder, where
from himpc.references import Reference, previews
from himpc.stack import Level, Stack
from himpc.telemetry import velocity_layout_of
from lessons.events import Event, InsertTask, MoveLevel, MoveTarget, Release, RemoveTask
from lessons.scenes.scene import VelocityScene
from lessons.session.commands import Commands, command_step
from lessons.session.controllers import VelocityController, make_velocity_controller
from lessons.session.distances import ObstacleDistances
from lessons.session.rows import write_bounds, write_truth, write_velocity_plan
from lessons.session.session import Session
from lessons.settings.missions import OrderOptions
from lessons.settings.settings import SceneSettings
from lessons.settings.velocity import VelocitySettings
from robots import InputError, PlantState, VelocityPlant
from robots.arrays import Array
from robots.errors import unknown_name


@final
class VelocitySession(Session[VelocityPlan]):
    """A run whose controller gives velocities. A control period has one or more commands to the servos;
    `advance` sends one of them.

    Attributes:
        bounds: the bounds in force.
        roles: the tasks of the scene's levels by name; a mission moves their points.
        progress: the progress of the mission.
    """

    scene: VelocityScene
    settings: VelocitySettings
    plant: VelocityPlant

    def __init__(self, scene: VelocityScene, seed: int = 0) -> None:
        """Raises InputError if the scene's settings do not fit its robot."""
        super().__init__(scene, seed, VelocityPlant(scene.robot, scene.settings.plant, seed))
        self.bounds = bounds(scene.robot, scene.settings.htmpc.limits)
        self._distances = ObstacleDistances(scene.robot, scene.settings.htmpc)
        self.roles = {task.name: task for level in scene.settings.htmpc.stack for task in level.tasks}
        self._arrange(velocity_layout_of(scene.robot, scene.settings.htmpc.stack))
        # Settings that do not fit the robot are refused here, not at the first tick.
        make_velocity_controller(scene.settings.controller, scene.robot, scene.settings.htmpc)
        self.reset()

    @property
    def t(self) -> float:
        # Rounding errors of the sum of command periods must not put a tick before its exact time.
        return round(self.plant.t, 9)

    def reset(self) -> None:
        super().reset()
        self.plant.reset(self.scene.q_0)
        home, _ = self._points(self.scene.q_0, np.zeros(self.robot.n))
        self.progress = Progress(self.settings.options.mission(home))
        self._stack: Stack = ()
        self.controller: VelocityController | None = None
        self._solve_ms = 0.0
        self._commands: Commands | None = None
        self._commanded = self._input = np.zeros(self.robot.n)
        self._nearest = np.full(2, np.inf)
        self._noticed: str | None = None

    @property
    def over(self) -> bool:
        return self.progress.done

    @property
    def settings_now(self) -> VelocitySettings:
        """The settings in force. If the scene has an option for the order of priorities, this option contains
        the present order of the run."""
        settings, options = self.settings, self.settings.options
        order = tuple(task.name for task in self.progress.mission if task.name in self.roles)
        if not isinstance(options, OrderOptions) or len(order) < len(self.roles):
            return settings
        own = () if order == tuple(self.roles) and not options.order else order
        return replace(settings, options=replace(options, order=own))

    def _happen(self, event: Event) -> None:
        match event:
            case MoveLevel(name, to):
                self.progress = reorder(self.progress, name, to)
            case MoveTarget(name, goal):
                self.progress = move(self.progress, name, goal)
            case Release(name):
                self.progress = release(self.progress, name)
            case RemoveTask(name):
                self.progress = remove(self.progress, name)
            case InsertTask():
                if event.role not in self.roles:
                    raise unknown_name("role", event.role, self.roles)
                self.progress = insert(self.progress, event.task(), event.before)
            case _:
                raise InputError("this scene is driven by velocity servos: a push would not move it")

    def adopt(self, settings: SceneSettings) -> None:
        assert isinstance(settings, VelocitySettings)
        # Nothing changes before controller and plant have accepted the settings. The next tick sets the order
        # of the window.
        fitted = make_velocity_controller(settings.controller, self.robot, settings.htmpc)
        distances = ObstacleDistances(self.robot, settings.htmpc)
        limits = bounds(self.robot, settings.htmpc.limits)
        if settings.plant != self.settings.plant:
            self.plant.configure(settings.plant)
        if settings.controller != self.settings.controller:
            self.controller = fitted if self.controller is not None else None
        self.settings, self.bounds, self._distances = settings, limits, distances
        self._noticed = None

    def _for_controller(self, settings: VelocitySettings) -> HTMPCSettings:
        """Returns the controller's settings for the levels of this tick."""
        lag = 1e-3 * settings.with_delay(self._solve_ms).latency_ms if settings.compensate_delay else 0.0
        hold = settings.htmpc.hold
        if settings.options.decoupled and self.progress.window:
            base = base_joints(self.robot)
            driving = self.progress.window[0].task.role == "base"
            # The base may turn on the spot: otherwise an arm that reaches only forwards could not reach a
            # goal behind it.
            still = set(range(self.robot.n)) - set(base) if driving else set(base[:2])
            hold = (*hold, *(self.robot.joint_names[joint] for joint in sorted(still)))
        obstacles = settings.options.reported(settings.htmpc.obstacles, self.t)
        return replace(settings.htmpc, stack=self._stack, delay_s=lag, hold=hold, obstacles=obstacles)

    def predicted_path(self, role: str) -> Array:
        """Returns the positions of a role's point in the last plan, knots 0 … N, (N+1, m) m; empty before the
        first tick."""
        return self._along_plan(self.roles[role].value)

    # ---------------------------------------------------------------- one tick

    @property
    def between(self) -> bool:
        return self._commands is not None

    @property
    def step_s(self) -> float:
        return command_step(self.settings.T_s)[1] if self._commands is None else self._commands.h

    def _decide(self, t: float, q: Array, v: Array) -> PlantState:
        settings, htmpc = self.settings, self.settings.htmpc
        state = self.plant.measure()
        points, speeds = self._points(state.q, state.v)
        self.progress = advanced(self.progress, settings.options.L, t, points, speeds)
        controller, references = self._direct()
        ahead = t + controller.settings.delay_s
        plan = controller.step(state.q, state.v, previews(references, ahead, htmpc.dt, htmpc.horizon))
        self.plan, self._solve_ms = plan, 1e-3 * plan.step_us
        if plan.notice not in (None, self._noticed):
            self.notices.append(plan.notice)  # once; the level's fallback shows how long it lasts
            self._noticed = plan.notice
        if (delayed := settings.with_delay(self._solve_ms)) != self.plant.settings:
            self.plant.configure(delayed)
        row, fields = self._row, self.layout.fields
        row.fill(np.nan)
        row[fields["tau_0"]] = self._commanded
        l_0 = row[fields["place"]] = self.progress.l_0
        row[fields["left"]] = len(self.progress.mission) - l_0
        write_velocity_plan(row, self.layout, plan, settings.lexicographic_delta)
        at = Configuration(self.robot, self._data, q, v)
        level_index = {level.name: index for index, level in enumerate(self._stack, start=1)}
        write_truth(row, self.layout, t, at, self.roles, level_index, references)
        self._commands = Commands(plan, htmpc.period, self._commanded)
        self._nearest = self._distances.at(q)
        return state

    def _act(self) -> bool:
        """Sends one command to the servos."""
        commands = self._commands
        assert commands is not None
        self.plant.step(commands.next(), commands.h)
        self._nearest = np.minimum(self._nearest, self._distances.at(self.plant.q))
        if not commands.done:
            return False
        self._commands = None
        row, fields, U = self._row, self.layout.fields, commands.plan.motion.U
        row[fields["tau"]] = row[fields["tau_demand"]] = commands.last
        row[fields["acceleration"]] = commands.sharpest
        row[fields["clearance"]], row[fields["clearance_reported"]] = self._nearest
        row[fields["jerk"]] = (U[0] - self._input) / min(commands.period, self.settings.htmpc.dt)
        write_bounds(row, self.layout)
        self._commanded, self._input = commands.last, U[0]
        return True

    def _direct(self) -> tuple[VelocityController, dict[str, Reference]]:
        """Returns the controller, with the window as its stack, and the references of its tasks by name."""
        stack: list[Level] = []
        references: dict[str, Reference] = {}
        for index, active in enumerate(self.progress.window, start=1):
            level = self._level(active.task.role)
            if level.name in references:
                # The window holds this role twice: the second one is a level of its own.
                task = replace(self.roles[active.task.role], name=f"{active.task.role} {index}")
                level = replace(level, tasks=(task,))
            stack.append(level)
            references[level.name] = active.reference
        self._stack = tuple(stack)
        wanted = self._for_controller(self.settings)
        self._distances.tell(wanted.obstacles)
        if self.controller is None:
            self.controller = make_velocity_controller(self.settings.controller, self.robot, wanted)
        elif wanted != self.controller.settings:
            self.controller.configure(wanted)
        return self.controller, references

    def _level(self, role: str) -> Level:
        return next(level for level in self.settings.htmpc.stack if level.tasks[0].name == role)

    def _points(self, q: Array, v: Array) -> tuple[dict[str, Array], dict[str, float]]:
        """Returns the position of each role's point, and its speed (m/s or rad/s)."""
        return where(Configuration(self.robot, self._data, q, v), self.roles)
