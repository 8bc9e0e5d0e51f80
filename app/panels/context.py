"""What the panels of one scene in one page share."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import viser

from app.client.simulation_client import SimulationClient
from app.html.palette import RGB
from app.link.choice import SceneChoice
from app.link.messages import Command, Post, Ready
from app.panels.widgets.in_view import InView
from app.panels.widgets.mirror import Bindings
from lessons.events import Event, MoveTarget
from robots import Robot


@dataclass(eq=False)
class PageContext:
    """The one object that panels are handed, instead of a callback for each thing that they do.

    Attributes:
        client: the browser.
        learner: the simulation and its recorded data.
        ready: the description of the scene. It is replaced when the run continues with another stack.
        colours: the colour of each level, by name. They are changed in place with the stack.
        loop: viser's event loop.
        dark: whether the page opened with the dark theme.
        choose: loads another scene or step.
        theme: called with True for the dark theme and with False for the light theme.
        in_view: the charts that the browser shows.
        bindings: for controls of settings that exist in every stack.
    """

    client: viser.ClientHandle
    learner: SimulationClient
    ready: Ready
    colours: dict[str, RGB]
    loop: asyncio.AbstractEventLoop
    dark: bool
    choose: Callable[[SceneChoice], None]
    theme: Callable[[bool], None]
    in_view: InView = field(init=False)
    bindings: Bindings[Any] = field(init=False)

    def __post_init__(self) -> None:
        self.in_view, self.bindings = InView(self.client), Bindings(self.post, self.loop)

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

    def post(self, event: Event, *also: MoveTarget) -> None:
        """Puts an event into the session's mailbox, with targets that take effect at the same tick."""
        self.learner.send(Post(event, also))

    def send(self, command: Command) -> None:
        """Sends a command to the simulation."""
        self.learner.send(command)

    def poses(self) -> np.ndarray | None:
        """Poses of all joints and the tip, (J, 7); None if another scene was loaded meanwhile, since
        its robot may have another number of joints."""
        learner = self.learner
        return learner.read(lambda block, _: block.poses() if learner.ready is self.ready else None)

    def poses_or_still(self) -> np.ndarray:
        """Returns `poses`, or identity poses if no poses are known, for objects that are built now and
        updated later."""
        poses = self.poses()
        still = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        return np.tile(still, (self.robot.model.njoints, 1)) if poses is None else poses
