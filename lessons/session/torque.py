"""The headless loop of a torque-level scene: references → controller → plant."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from himpc.controllers import Controller
from himpc.formulation.settings import WEIGHTS, same_structure
from himpc.kinematics.configuration import Configuration
from himpc.plan import Plan, write_plan
from himpc.references import Outlook, Preview, Reference, Target
from himpc.references.outlook import NOTHING
from himpc.stack import Stack, about, ranks
from himpc.tasks import FramePosition, Task
from himpc.telemetry import layout_of
from lessons.events import Event, MoveTarget, Push
from lessons.scenes.scene import TorqueScene
from lessons.session.bumpless import Handover, settled
from lessons.session.commands import DelayedTorque
from lessons.session.controllers import controller_of
from lessons.session.distances import Clearance, objects_of
from lessons.session.rows import at_once, dynamic_leak
from lessons.session.session import Session
from lessons.session.targets import carried, kept, move_target, target_at
from lessons.settings.period import check_period, warning
from lessons.settings.settings import SceneSettings
from lessons.settings.stack import same_tasks
from lessons.settings.torque import TorqueSettings
from robots import InputError, Plant, PlantState, Robot, convergence_gauge
from robots.mechanics.model import compiled

Array = NDArray[np.float64]

TRUTH_TICKS = 20
"""Ticks between two updates of the values that need the plant's M (gauge of M̄, true leak)."""


class ControllerInput(NamedTuple):
    """The measured state, (n,) each, and the references' previews: all inputs of a controller at a tick."""

    q: Array
    v: Array
    previews: Mapping[str, Preview]


@final
class TorqueSession(Session[Plan]):
    """A run whose controller gives torques: every step is a control tick.

    Attributes:
        controller_input: the inputs from which the controller computed the last plan.
        clearance: measures the nearest pair.
    """

    scene: TorqueScene
    settings: TorqueSettings
    plant: Plant

    def __init__(
        self,
        scene: TorqueScene,
        seed: int = 0,
        controllers: Callable[[TorqueSettings, Robot], Controller] = controller_of,
    ) -> None:
        """controllers: makes the controller that settings name. Raises InputError if the scene's settings do
        not fit its robot."""
        super().__init__(scene, seed, Plant(scene.robot, scene.settings.plant, world=scene.world))
        self._controller_of = controllers
        check_period(scene.robot, scene.settings)
        self.controller = self._controller_of(scene.settings, scene.robot)
        self._arrange(layout_of(scene.robot, scene.settings.levels))
        self.clearance = Clearance(self.plant)
        self.reset()

    def reset(self) -> None:
        super().reset()
        scene = self.scene
        self.plant.reset(scene.q_0, scene.v_0, scene.tau_0)
        self.controller.reset(self.plant.tau)
        self.clearance.reset()
        self.references = self._fresh_references()
        self.controller_input: ControllerInput | None = None
        self._push_until, self._ticks = math.inf, 0
        self._outbox = DelayedTorque()
        self._truth = (math.nan, math.nan, math.nan)

    def _fresh_references(self) -> dict[str, Reference]:
        motion = self.settings.options or self.scene
        references = motion.references(self.robot, self.settings.levels)
        start = Configuration(self.robot, self._data, self.scene.q_0, self.scene.v_0)
        return {
            task.name: kept(task, references.get(task.name), task.target(start))
            for task in _tasks(self.settings.levels)
        }

    def _references_for(self, stack: Stack) -> dict[str, Reference]:
        """Returns the references under another stack. A task that remains or was only renamed keeps its
        reference; new tasks, and tasks that control something else now, hold their present values."""
        here = Configuration(self.robot, self._data, self.plant.q, self.plant.v)
        old = {task.name: task for task in _tasks(self.settings.levels)}
        new = {task.name for task in _tasks(stack)}
        gone = {about(task): task for task in old.values() if task.name not in new}
        references = {}
        for task in _tasks(stack):
            before = old.get(task.name) or gone.get(about(task))
            value = task.target(here)
            references[task.name] = (
                target_at(task, value)
                if before is None
                else carried(before, self.references[before.name], task, value)
            )
        return references

    @property
    def M_bar(self) -> Array:
        """Diagonal of the M̄ in force, (n,) kg·m²."""
        M_bar = None if self.plan is None else self.plan.M_bar
        return np.array(self.settings.M_bar) * self.settings.M_bar_scale if M_bar is None else M_bar

    def target(self, task: str) -> Target | None:
        """Returns the draggable target of a task, None if its reference is a fixed motion."""
        reference = self.references.get(task)
        return reference if isinstance(reference, Target) else None

    def _happen(self, event: Event) -> None:
        match event:
            case MoveTarget(task, value):
                tasks = {candidate.name: candidate for candidate in _tasks(self.settings.levels)}
                move_target(tasks, self.references, task, value)
            case Push(body, force, torque, seconds):
                if not (math.isfinite(seconds) and seconds > 0):
                    raise InputError(f"a push cannot last {seconds} s: give a time above 0")
                try:
                    self.plant.push(body, np.array(force), np.array(torque))
                except InputError:
                    raise
                except ValueError as error:
                    raise InputError(f"the push was not applied: {error}") from None
                self._push_until = self.t + seconds
            case _:
                raise InputError("This scene has no mission: choose one of the HTMPC scenes.")

    def adopt(self, settings: SceneSettings) -> None:
        assert isinstance(settings, TorqueSettings)
        if same_structure(settings, self.settings, WEIGHTS):
            self.controller.configure(settings.for_controller())
            self.settings = settings
            return
        check_period(self.robot, settings)
        layout, references = self.layout, self.references
        recomposed = not same_tasks(settings.levels, self.settings.levels)
        if recomposed:
            layout, references = layout_of(self.robot, settings.levels), self._references_for(settings.levels)
        # Plant and controller may both refuse the settings. The plant changes after both have accepted them.
        changed, world = settings.plant != self.settings.plant, self.plant.world
        model = compiled(self.robot, settings.plant, world) if changed else None
        if settings.controller == self.settings.controller:
            self.controller.configure(settings.for_controller())
        else:
            self._hand_over(self._controller_of(settings, self.robot))
        if model is not None:
            self.plant.configure(settings.plant, model)
        if recomposed:
            self.references, self.plan, self.controller_input = references, None, None
            self._arrange(layout)
        before, self.settings = self.settings, settings
        told = warning(self.robot, settings)
        if told and not warning(self.robot, before):
            self.notices.append(told)

    def _hand_over(self, taking: Controller) -> None:
        taking.reset(self.plant.tau)
        self.controller = Handover(self.controller, taking)

    def renew(self) -> None:
        """Switches to the user's changed code without a jump in torque. Raises InputError if the code has a
        fault; the old code then remains in use."""
        self._hand_over(self._controller_of(self.settings, self.robot))
        self.failure = None

    def _decide(self, t: float, q: Array, v: Array) -> PlantState:
        settings, plant, row, at = self.settings, self.plant, self._row, self.layout.fields
        tau, T_s = plant.tau, settings.T_s
        if t >= self._push_until - 1e-9:
            plant.push(None)
            self._push_until = math.inf
        state = plant.measure(T_s)
        around = objects_of(plant) if settings.limits.avoidance.on else NOTHING
        ahead = Outlook(self.references, t, T_s, settings.horizon, around)
        self.controller = settled(self.controller)
        plan = self.controller.step(state.q, state.v, ahead, tau)
        write_plan(row, self.layout, plan, ahead)
        row[at["v_limit"]], row[at["v_limit_lowered"]] = plan.limits.user_v_limit, plan.limits.v_limit
        self.plan, self.controller_input = plan, ControllerInput(state.q, state.v, ahead)
        # Adjacent fields: dynamic_leak, gauge_norm, gauge_radius.
        truth = at["dynamic_leak"].start
        row[truth], row[truth + 1], row[truth + 2] = self._true(plan, q, ahead)
        if plan.notice is not None:
            self.failure = plan.notice
        late = row[at["late"].start] = settings.is_late(1e-3 * plan.step_us)
        self._applied = self._outbox.applied(plan.tau, late, tau)
        return state

    def _act(self) -> bool:
        row, at, plant = self._row, self.layout.fields, self.plant
        row[at["tau"]] = plant.step(self._applied, self.settings.T_s)
        touch = at["contact_depth"].start
        row[touch], row[touch + 1] = plant.touch
        near, avoidance = at["distance"].start, self.settings.limits.avoidance
        row[near], row[near + 1] = self.clearance.measure(row[at["q"]], avoidance)
        self._ticks += 1
        return True

    def _true(self, plan: Plan, q: Array, ahead: Mapping[str, Preview]) -> tuple[float, float, float]:
        """Returns the true leak and the gauge of M̄, which need the plant's M, as of the last update."""
        if self._ticks % TRUTH_TICKS == 0 and math.isfinite(float(q.sum())):
            M = self.plant.mass_matrix()
            done = None
            if plan.at_once is not None:
                done = plan.at_once()
            elif plan.leak is not None and not math.isnan(plan.leak):
                here = Configuration(self.robot, self._data, q, q, previews=ahead)
                done = at_once(plan, self.settings.levels, here)
            leak = math.nan if done is None or len(done.increments) < 2 else dynamic_leak(M, done)
            self._truth = (leak, *convergence_gauge(M, self.M_bar))
        return self._truth

    def _is_wild(self, q: Array, v: Array) -> bool:
        return self.plant.broken or super()._is_wild(q, v)

    def predicted_path(self, frame: str = "") -> Array:
        """Predicted positions of a frame at knots 0 … N of the last plan, (N+1, 3) m."""
        return self._along_plan(lambda at: at.placement(frame).translation)

    def reference_path(self, task: str, points: int = 200) -> Array | None:
        reference = self.references.get(task)
        phase = getattr(reference, "phase", None)
        tasks = {candidate.name: candidate for candidate in _tasks(self.settings.levels)}
        followed = tasks.get(task)
        if reference is None or phase is None or not isinstance(followed, FramePosition):
            return None
        preview = reference.preview(0.0, 2 * np.pi / phase.omega / (points - 1), points - 1)
        start = Configuration(self.robot, self._data, self.scene.q_0, self.scene.v_0)
        path = np.tile(start.placement(followed.frame).translation, (points, 1))
        path[:, followed.components] = preview.value + preview.displacement
        return path

    def ranks(self) -> dict[str, tuple[int, int]]:
        """Returns the ranks of the enabled levels at the present posture, see `himpc.stack.ranks`."""
        q = np.asarray(self.plant.q)
        return ranks(self.settings.levels, Configuration(self.robot, self._data, q, q))


def _tasks(stack: Stack) -> list[Task]:
    return [task for level in stack for task in level.tasks]
