"""The interface between a stage and the user interface of a kind of scene."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
import viser

from app.client.moment import Moment
from app.client.simulation_client import SimulationClient
from app.html.palette import RGB
from app.link.messages import Post, Ready, Status
from app.panels.widgets.in_view import InView
from app.panels.widgets.mirror import Bindings
from app.panels.widgets.snapshot import SessionSnapshot
from app.view.robot import RobotView
from lessons.events import Event, MoveTarget


@dataclass(frozen=True, eq=False)
class Context:
    """The data of a page that its user interface needs. in_view: the charts that the browser shows; bindings:
    for the settings of this kind of scene; theme: called with True for the dark theme and with False for the
    light theme."""

    client: viser.ClientHandle
    in_view: InView
    learner: SimulationClient
    ready: Ready
    colours: dict[str, RGB]
    bindings: Bindings[Any]
    loop: asyncio.AbstractEventLoop
    dark: bool
    theme: Callable[[bool], None]

    def post(self, event: Event, *also: MoveTarget) -> None:
        """Puts an event into the session's mailbox, with targets that take effect at the same tick."""
        self.learner.send(Post(event, also))

    @property
    def settings(self) -> Any:
        """The present settings. Their type depends on the kind of scene."""
        return self.learner.settings_of(self.ready)

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
        return np.tile(still, (self.ready.robot.model.njoints, 1)) if poses is None else poses


Tabs = viser.PanelHandle | viser.GuiTabGroupHandle


class Face(Protocol):
    """The user interface of a kind of scene. It is built by `open_plots`, `add_start`, `add_tasks`,
    `add_control`, `add_plant`, `add_plots` and `add_scene`, in this order. `follow` is called for every
    frame."""

    fastest: ClassVar[float]
    """The highest useful speed of the simulation, simulated seconds per second."""

    def add_start(self, gui: viser.GuiApi) -> None:
        """Adds what to try first: the target, pushes, what is drawn."""
        ...

    def add_tasks(self, gui: viser.GuiApi, strip: viser.GuiTabHandle | None) -> None:
        """Adds the levels and what stands with them; the rows of the levels also to the tab `strip` of a
        panel over the scene."""
        ...

    def add_control(self, gui: viser.GuiApi) -> None:
        """Adds the settings of the controller."""
        ...

    def add_plant(self, gui: viser.GuiApi) -> None:
        """Adds the settings of the plant."""
        ...

    @property
    def opens_inside(self) -> bool:
        """Whether the picture of a tick is what this scene is about: its tab then is the first one."""
        ...

    def open_plots(self, plots: Tabs) -> None:
        """Adds the tab of the picture of a tick, which precedes the lesson's tab, if it is the first one."""
        ...

    def add_plots(self, gui: viser.GuiApi, plots: Tabs, inside: Tabs) -> None:
        """Adds the plots of this kind, and to `inside` the picture of a tick, if there is one."""
        ...

    def add_scene(self, scene: viser.SceneApi, robot: RobotView) -> None:
        """Adds all objects except the robot and the floor to the 3D view."""
        ...

    def recompose(self, ready: Ready) -> None:
        """Updates the interface when the run continues with another stack."""
        ...

    def toggle(self, place: int) -> Event | None:
        """Returns the event that switches the level at an index (0-based) on or off; None if there is no such
        level."""
        ...

    def follow(self, moment: Moment) -> None:
        """Updates everything that changes with every frame."""
        ...

    def after_reset(self, status: Status) -> None:
        """Updates the interface after the robot was reset to its start."""
        ...

    def draw(self, moment: Moment) -> None:
        """Updates curves and plots, about ten times per second."""
        ...

    def write(self, now: SessionSnapshot[Any]) -> None:
        """Updates texts, a few times per second."""
        ...

    def close(self) -> None:
        """Stops all updates, before the scene is removed."""
        ...
