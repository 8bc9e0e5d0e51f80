"""The interface between a stage and the user interface of a kind of scene."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import viser

from app.client.moment import Moment
from app.link.messages import Status
from app.tab.context import SessionSnapshot
from app.view.robot import RobotView
from lessons.events import Event

Tabs = viser.PanelHandle | viser.GuiTabGroupHandle


class Face(Protocol):
    """The user interface of a kind of scene. It is built by `open_plots`, `add_start`, `add_tasks`,
    `add_control`, `add_plant`, `add_plots` and `add_scene`, in this order. `follow` is called for every
    frame."""

    fastest: ClassVar[float]
    """The highest useful speed of the simulation, simulated seconds per second."""

    def add_start(self) -> None:
        """Adds what to try first: the target, pushes, what is drawn."""
        ...

    def add_tasks(self, strip: viser.GuiTabHandle | None) -> None:
        """Adds the levels and what stands with them; the rows of the levels also to the tab `strip` of a
        panel over the scene."""
        ...

    def add_control(self) -> None:
        """Adds the settings of the controller."""
        ...

    def add_plant(self) -> None:
        """Adds the settings of the plant."""
        ...

    @property
    def opens_inside(self) -> bool:
        """Whether the picture of a tick is what this scene is about: its tab then is the first one."""
        ...

    def open_plots(self, plots: Tabs) -> None:
        """Adds the tab of the picture of a tick, which precedes the lesson's tab, if it is the first one."""
        ...

    def add_plots(self, plots: Tabs, inside: Tabs) -> None:
        """Adds the plots of this kind, and to `inside` the picture of a tick, if there is one."""
        ...

    def add_scene(self, scene: viser.SceneApi, robot: RobotView) -> None:
        """Adds all objects except the robot and the floor to the 3D view."""
        ...

    def recompose(self) -> None:
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
