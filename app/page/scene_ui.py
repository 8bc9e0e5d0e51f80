"""What a stage asks of the kind of scene it shows."""

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
from lessons.events import Event


@dataclass(frozen=True, eq=False)
class Context:
    """Where a face lives. in_view: what its browser shows; bindings: of the kind's settings; theme: called
    with a new theme, dark or not."""

    client: viser.ClientHandle
    in_view: InView
    learner: SimulationClient
    ready: Ready
    colours: dict[str, RGB]
    bindings: Bindings[Any]
    loop: asyncio.AbstractEventLoop
    dark: bool
    theme: Callable[[bool], None]

    def post(self, event: Event) -> None:
        """An event for the session's mailbox."""
        self.learner.send(Post(event))

    @property
    def settings(self) -> Any:
        """The settings in force, of the scene's kind."""
        return self.learner.settings_of(self.ready)

    def poses(self) -> np.ndarray | None:
        """Poses of joints 1 … n and the tip, (n + 1, 7); None if they are another scene's by now, whose robot
        may have other joints."""
        learner = self.learner
        return learner.read(lambda block, _: block.poses() if learner.ready is self.ready else None)

    def poses_or_still(self) -> np.ndarray:
        """The same, for what is built now and follows later; where nothing is known, frames at the origin."""
        poses = self.poses()
        still = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        return np.tile(still, (self.ready.robot.n + 1, 1)) if poses is None else poses


class Face(Protocol):
    """Built in this order: first plot, tabs, plots, scene. `follow` comes with every frame."""

    fastest: ClassVar[float]
    """The highest speed of the simulation that makes sense, simulated seconds per second."""

    def add_tabs(self, gui: viser.GuiApi, tabs: viser.GuiTabGroupHandle) -> None:
        """The kind's tabs, the first one first."""
        ...

    def open_plots(self, plots: viser.PanelHandle | viser.GuiTabGroupHandle) -> None:
        """The tab of the panel on the left that comes before the lesson's, if any does."""
        ...

    def add_plots(self, gui: viser.GuiApi, plots: viser.PanelHandle | viser.GuiTabGroupHandle) -> None:
        """The kind's tabs of the panel on the left."""
        ...

    def add_scene(self, scene: viser.SceneApi, robot: RobotView) -> None:
        """What the 3D view shows besides robot and floor."""
        ...

    def recompose(self, ready: Ready) -> None:
        """The same run goes on under another stack."""
        ...

    def toggle(self, place: int) -> Event | None:
        """The event that switches the level at a place (0-based) on or off; None if there is none."""
        ...

    def follow(self, moment: Moment) -> None:
        """A new frame."""
        ...

    def after_reset(self, status: Status) -> None:
        """The robot was put back to its start."""
        ...

    def draw(self, moment: Moment) -> None:
        """Curves and plots, about ten times a second."""
        ...

    def write(self, now: SessionSnapshot[Any]) -> None:
        """Texts, a few times a second."""
        ...

    def close(self) -> None:
        """The scene is about to go."""
        ...
