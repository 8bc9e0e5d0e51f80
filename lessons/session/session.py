"""The headless loop of both kinds of scenes: one scene, one controller, one plant, one mailbox."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

from himpc.kinematics.configuration import Configuration
from himpc.plan import Binding, TickPlan
from himpc.telemetry import Layout
from lessons.events import Event, Reset, Set
from lessons.scenes.scene import Scene
from lessons.settings.settings import SceneSettings
from robots import InputError, Plant, PlantState, Robot, VelocityPlant
from robots.arrays import Array

AnyPlan = TypeVar("AnyPlan", bound=TickPlan)

LOST_SPEED = 20.0
"""A joint whose speed is more than this many times its limit counts as divergence."""


class Session(ABC, Generic[AnyPlan]):
    """One learner's run. `tick` advances one control period, `advance` the smallest possible step; events
    wait in the mailbox until a period begins.

    Attributes:
        scene: the scene from which the session started.
        seed: seed of the run; all randomness comes from it.
        robot: the scene's robot.
        settings: the settings in force.
        layout: the indices of the fields of a row.
        plant: the simulation.
        plan: the last plan, None before the first tick.
        diverged_at: simulated time at which control was lost, s; None if it was not.
        failure: one sentence if the user's code no longer controls the robot; None as long as it does.
        notices: sentences for the learner (refused events, divergence); the reader removes them.
        log: (time, event) of every event that took effect.
    """

    plan: AnyPlan | None

    def __init__(self, scene: Scene, seed: int, plant: Plant | VelocityPlant) -> None:
        self.settings = scene.settings
        self.plant = plant
        self.scene = scene
        self.seed = seed
        self.robot: Robot = scene.robot
        self.notices: list[str] = []
        self.log: list[tuple[float, Event]] = []
        self._data = scene.robot.model.createData()
        self._mailbox: deque[Event] = deque()

    def _arrange(self, layout: Layout) -> None:
        """Sets the layout of the rows; a subclass calls it before the first tick."""
        self.layout, self._row = layout, np.full(layout.size, np.nan)

    # ---------------------------------------------------------------- time

    @property
    def t(self) -> float:
        """Simulated time since the last reset, s."""
        return self.plant.t

    @property
    def step_s(self) -> float:
        """Simulated time of the next `advance`, s."""
        return self.settings.T_s

    @property
    def between(self) -> bool:
        """Whether a control period is in progress: events that are posted now wait for its end."""
        return False

    @property
    def over(self) -> bool:
        """Whether the run is complete; a headless run then ends."""
        return False

    def advance(self) -> Array | None:
        """Computes one step: events, plan and row if a control period begins, then the plant. Returns the row
        of `tick` if a control period ended with it, else None."""
        begins = not self.between
        if begins and (self._mailbox or self._script):
            self.drain()
        row, at, plant = self._row, self.layout.fields, self.plant
        if begins:
            t, q, v = self.t, plant.q, plant.v
            state = self._decide(t, q, v)
            row[at["t"].start], row[at["q"]], row[at["v"]] = t, q, v
            row[at["q_measured"]], row[at["v_measured"]] = state.q, state.v
        if not self._act():
            return None
        if self.diverged_at is None and self._is_wild(row[at["q"]], row[at["v"]]):
            self._lost(row.item(at["t"].start))
        return row

    @abstractmethod
    def _decide(self, t: float, q: Array, v: Array) -> PlantState:
        """Begins a control period: computes the plan and writes it into the row. Returns the measured state.

        Args:
            t: the time, s.
            q, v: the plant's true state, (n,) each.
        """

    @abstractmethod
    def _act(self) -> bool:
        """Moves the plant by `step_s`. Returns whether the control period is over; the row is then
        complete."""

    def _is_wild(self, q: Array, v: Array) -> bool:
        """Returns whether control is lost: a state that is not finite or far too fast. A large error alone is
        not a loss: a target may be out of reach, and missions have goals metres away."""
        share = v / self.robot.v_limit
        # A comparison with NaN is false, so "not within" is also true for values that are not finite.
        slow = share.dot(share) <= LOST_SPEED**2 or float(np.abs(share).max()) <= LOST_SPEED
        return not slow or not math.isfinite(q.dot(q))

    def tick(self) -> Array:
        """Computes one control period. Returns the row of telemetry at its start (a buffer: copy it to keep
        it)."""
        row = self.advance()
        while row is None:
            row = self.advance()
        return row

    def reset(self) -> None:
        """Returns to the scene's start and keeps the settings."""
        self.diverged_at: float | None = None
        self.failure: str | None = None
        self.plan = None
        self._script = deque(self.scene.events)

    def _lost(self, t: float) -> None:
        """Called when control was lost, at time t, s."""
        self.notices.append(f"The robot is out of control since t = {t:.2f} s: press Reset.")
        self.diverged_at = t

    # ---------------------------------------------------------------- events

    def post(self, event: Event) -> None:
        """Puts an event in the mailbox; it takes effect when a control period begins, or leaves a notice."""
        self._mailbox.append(event)

    def drain(self) -> None:
        """Applies the events in the mailbox now; simulated time does not advance. A control period calls this
        itself; a paused page calls it to show a change at once.
        """
        while self._script and self._script[0][0] <= self.t + 1e-9:
            self._mailbox.append(self._script.popleft()[1])
        while self._mailbox:
            event = self._mailbox.popleft()
            try:
                self._take(event)
                self.log.append((self.t, event))
            except InputError as error:
                self.notices.append(str(error))

    def _take(self, event: Event) -> None:
        match event:
            case Reset():
                self.reset()
            case Set(path, value):
                self.adopt(self.settings.changed(path, value))
            case _ if self.settings.takes(event):
                self.adopt(self.settings.after(event))
            case _:
                self._happen(event)

    @abstractmethod
    def _happen(self, event: Event) -> None:
        """Carries out an event that changes no settings. Raises InputError for an event that this kind of
        session does not have.
        """

    @abstractmethod
    def adopt(self, settings: SceneSettings) -> None:
        """Takes over settings of the scene's kind at once, like an event that changes them. Raises InputError
        if they do not fit."""

    # ---------------------------------------------------------------- state for the page

    @property
    def settings_now(self) -> SceneSettings:
        """The settings in force. They include those parts of the run's state that a scene has as settings."""
        return self.settings

    def binding(self) -> list[Binding]:
        """Returns the active constraints of the last plan."""
        return [] if self.plan is None else self.plan.binding(self.robot.joint_names)

    def _along_plan(self, point: Callable[[Configuration], Array]) -> Array:
        """Returns a point of the robot at knots 0 … N of the last plan, (N+1, m) m; empty before the first
        tick."""
        if self.plan is None:
            return np.empty((0, 3))
        return np.array([point(Configuration(self.robot, self._data, q, q)) for q in self.plan.q])

    def reference_path(self, task: str, points: int = 200) -> Array | None:
        """Returns one period of a periodic position reference, (points, 3) m; None for other references."""
        return None
