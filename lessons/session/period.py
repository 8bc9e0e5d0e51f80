"""Whether the control period is short enough for time-delay estimation with the robot's M̄."""

from __future__ import annotations

import numpy as np

from lessons.settings.torque import TorqueSettings
from robots import Plant, Robot, tracking_bandwidth

SLOWEST = 3.0
"""Bandwidth, 1/s, of a robot that is slow but does not swing. panda-hold follows with 3.1 1/s, and swings
with 1.5 1/s."""
_WITH_MODEL = ("osf", "osf_damped", "hqp")
"""Controllers that use a dynamic model in place of time-delay estimation."""


def period_too_long(robot: Robot, settings: TorqueSettings) -> str:
    """Returns the sentence for a T_s that lets the robot swing; "" for a shorter one.

    The lag of time-delay estimation is T_s/λ_min(M⁻¹M̄), at home. Lower gains do not help if it is long: the
    estimate then follows gravity and coupling too slowly.
    """
    if settings.controller in _WITH_MODEL:
        return ""
    M, M_bar = Plant(robot, settings.plant).mass_matrix(), np.array(settings.M_bar) * settings.M_bar_scale
    longest = tracking_bandwidth(M, M_bar, SLOWEST)
    if settings.T_s <= longest:
        return ""
    return (
        f"T_s = {1e3 * settings.T_s:.3g} ms is too long for {robot.name}: time-delay estimation with its M̄ "
        f"lags, and the robot swings. Choose at most {1e3 * longest:.2g} ms, or add rotor inertia "
        "(plant.armature) and a larger M̄."
    )
