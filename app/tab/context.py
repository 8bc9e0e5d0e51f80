"""What the panels and the 3D view of one scene in one page share."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np
import viser

from app.client.simulation_client import SimulationClient
from app.html.palette import RGB
from app.link.choice import SceneChoice
from app.link.messages import Command, MissionRow, Post, Ready, Status
from app.tab.comfort import Facts
from app.tab.in_view import InView
from app.tab.mirror import Bindings
from app.tab.visitor import Visitor
from lessons.events import Event, MoveTarget
from lessons.settings.settings import SceneSettings
from robots import Robot

S_co = TypeVar("S_co", bound=SceneSettings, covariant=True)


@dataclass(frozen=True, eq=False)
class SessionSnapshot(Generic[S_co]):
    """latest: the last telemetry row; bound_seconds: (n, number of constraints), the time, s, that each joint
    has spent at the bound of each of himpc's `CONSTRAINTS` since the last reset."""

    ready: Ready
    settings: S_co
    status: Status
    latest: np.ndarray
    bound_seconds: np.ndarray

    def field(self, name: str) -> np.ndarray:
        """Returns a field of the last row."""
        return self.latest[self.ready.layout.fields[name]]

    def number(self, name: str) -> float:
        """Returns a scalar field of the last row; NaN if the layout has no field of this name."""
        where = self.ready.layout.fields.get(name)
        return float("nan") if where is None else float(self.latest[where][0])

    def fallback(self, level: str) -> str:
        """Returns the name of the fallback with which a level was solved at the last row; "" if none was
        needed or the level was not solved."""
        code = self.number(f"fallback/{level}")
        return self.ready.layout.fallbacks[int(code)] if code > 0 else ""

    def error(self, task: str) -> float:
        """Returns the error norm ‖x̃‖ of a task, m or rad."""
        return float(np.linalg.norm(self.field(f"error/{task}")))

    def facts(self) -> Facts:
        """Returns what the page says in sentences."""
        status, fields = self.status, self.ready.layout.fields
        return Facts(
            status.running,
            status.resets,
            tuple((level.name, level.enabled) for level in self.settings.levels),
            {
                task.name: (self.error(task.name), task.unit)
                for task in self.ready.tasks
                if f"error/{task.name}" in fields
            },
            frozenset((each.kind, each.joint) for each in status.binding),
        )


@dataclass(eq=False)
class PageContext:
    """The one object that panels and the 3D view are handed, instead of a callback for each thing that they
    do.

    Attributes:
        visitor: the browser tab and the person at it.
        learner: the simulation and its recorded data.
        ready: the description of the scene. It is replaced when the run continues with another stack.
        colours: the colour of each level, by name. They are changed in place with the stack.
        choose: loads another scene or step.
        in_view: the charts that the browser shows.
        bindings: for controls of settings that exist in every stack.
        dragged: whether a target of this scene was dragged.
    """

    visitor: Visitor
    learner: SimulationClient
    ready: Ready
    colours: dict[str, RGB]
    choose: Callable[[SceneChoice], None]
    in_view: InView = field(init=False)
    bindings: Bindings[Any] = field(init=False)
    dragged: bool = False

    def __post_init__(self) -> None:
        self.in_view, self.bindings = InView(self.client), Bindings(self.post, self.loop)

    @property
    def client(self) -> viser.ClientHandle:
        return self.visitor.client

    @property
    def loop(self) -> asyncio.AbstractEventLoop:
        return self.visitor.loop

    @property
    def gui(self) -> viser.GuiApi:
        return self.client.gui

    @property
    def robot(self) -> Robot:
        return self.ready.robot

    @property
    def settings(self) -> Any:
        """The present settings. Their type depends on the kind of scene."""
        return self.learner.settings_of(self.ready)

    @property
    def in_lesson(self) -> bool:
        return self.ready.choice.exercise is not None

    @property
    def mission_rows(self) -> tuple[MissionRow, ...] | None:
        """The tasks of the mission; None if the scene has no mission, or before the first report."""
        status = self.learner.status
        return None if status is None or status.mission is None else status.mission.rows

    def post(self, event: Event, *also: MoveTarget) -> None:
        """Puts an event into the session's mailbox, with targets that take effect at the same tick."""
        self.learner.send(Post(event, also))

    def send(self, command: Command) -> None:
        """Sends a command to the simulation."""
        self.learner.send(command)

    def notify(self, title: str, sentence: str) -> None:
        """Shows why a request has no effect."""
        self.client.add_notification(title, sentence, color="orange", auto_close_seconds=10.0)

    def poses(self) -> np.ndarray | None:
        """Poses of all joints and the tip, (J, 7); None if another scene was loaded meanwhile, since
        its robot may have another number of joints."""
        learner = self.learner
        return learner.read(lambda run: run.block.poses() if learner.ready is self.ready else None)

    def poses_or_still(self) -> np.ndarray:
        """Returns `poses`, or identity poses if no poses are known, for objects that are built now and
        updated later."""
        poses = self.poses()
        still = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        return np.tile(still, (self.robot.model.njoints, 1)) if poses is None else poses
