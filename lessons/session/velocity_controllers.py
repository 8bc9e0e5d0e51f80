"""The velocity-level controllers behind one interface."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc import HTIDKC, HTMPC, HTMPC_WPT, STMPC, HTMPCSettings, Placo, VelocityPlan
from himpc.references import Preview
from robots import Robot

Array = NDArray[np.float64]


class VelocityController(Protocol):
    """The methods of a controller that a velocity-level session uses."""

    @property
    def settings(self) -> HTMPCSettings:
        """The settings in use."""
        ...

    def configure(self, settings: HTMPCSettings) -> None:
        """Applies new settings at once, without a jump. Raises InputError, without any change, if they do not
        fit."""
        ...

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan:
        """Computes one control period. It raises no exception, whatever the state, and all numbers of the
        motion are finite."""
        ...


_MAKERS: dict[str, Callable[[Robot, HTMPCSettings], VelocityController]] = {
    "htmpc": HTMPC,
    "htmpc_wpt": HTMPC_WPT,
    "stmpc": STMPC,
    "htidkc": HTIDKC,
    "placo": Placo,
}


def make_velocity_controller(name: str, robot: Robot, settings: HTMPCSettings) -> VelocityController:
    """Returns a controller by its name. Raises InputError for settings that do not fit the robot."""
    return _MAKERS[name](robot, settings)
