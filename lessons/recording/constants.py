"""Constants of a run that an independent replay needs in addition to its rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from himpc.constants import RETURN_RATE
from himpc.htmpc.settings import bounds
from himpc.limits import POSITION_MARGIN, reaction
from lessons.settings.settings import SceneSettings
from lessons.settings.torque import TorqueSettings
from lessons.settings.velocity import VelocitySettings
from robots import Robot


def constants(robot: Robot, settings: SceneSettings) -> dict[str, Any]:
    """a_max, (n,) rad/s² (m/s²), and the constants of the bound that stops a joint before its limit: margin
    (rad), reaction (s) and return rate (1/s); NaN if this bound is not in force. It is never in force at
    velocity level."""
    a_max, *bound = _OF[type(settings)](robot, settings)
    names = ("position_margin", "position_reaction", "position_return_rate")
    return {"a_max": np.array(a_max), **dict(zip(names, map(np.array, bound), strict=True))}


def _torque(robot: Robot, settings: TorqueSettings) -> tuple[Any, ...]:
    if settings.limits.position != "viability":
        return robot.a_max, np.nan, np.nan, np.nan
    return robot.a_max, POSITION_MARGIN, reaction(settings.limits, settings.T_s), RETURN_RATE


def _velocity(robot: Robot, settings: VelocitySettings) -> tuple[Any, ...]:
    return bounds(robot, settings.htmpc.limits).a, np.nan, np.nan, np.nan


_OF: Mapping[type[SceneSettings], Callable[[Robot, Any], tuple[Any, ...]]] = {
    TorqueSettings: _torque,
    VelocitySettings: _velocity,
}
