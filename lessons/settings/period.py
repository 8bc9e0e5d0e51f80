"""Which control periods suit time-delay estimation with the robot's M̄, gains and sensors."""

from __future__ import annotations

import math

import numpy as np

from himpc.catalog import CONTROLLERS, WITH_MODEL
from lessons.settings.torque import TorqueSettings
from robots import InputError, Robot, tracking_bandwidth
from robots.inertia import SLOW, mass_matrix
from robots.truth import encoder_resolution, true_model

USUAL = 1e-3
"""s: the papers' period. It and shorter ones are never refused: lessons change M̄ with it."""


def longest_period(robot: Robot, settings: TorqueSettings) -> float:
    """Returns the longest T_s, s, at which time-delay estimation has the bandwidth `SLOW` at home, to two
    digits; inf for controllers that use a dynamic model, for those in files of users, and for an M̄ of the
    wrong length, which the controller refuses.

    The estimate lags by T_s/λ_min(M⁻¹M̄). Lower gains do not help if this is long: the estimate then follows
    gravity and coupling too slowly.
    """
    if settings.controller in WITH_MODEL or settings.controller not in CONTROLLERS:
        return math.inf
    if len(settings.M_bar) != robot.n:
        return math.inf
    return _bandwidth(robot, settings, SLOW)


def warning(robot: Robot, settings: TorqueSettings) -> str:
    """Returns one sentence if the robot swings or shakes with these settings, as T_s is too long for M̄ or
    for the gains, or too short for the sensors; otherwise "".

    With the lag l of its acceleration, (4) is the third-order loop l x⃛ + ẍ + K_v ẋ + K_p x = 0, which is
    stable if l K_p < K_v. One digit δ of a sensor changes the torque by M̄δ/T_s², which must be less than the
    motor has.
    """
    longest, T_s = longest_period(robot, settings), settings.T_s
    if T_s > longest:
        ways = [f"at most {1e3 * longest:.2g} ms"] if longest >= 1e-4 else []
        ways += ["a larger M̄"] if settings.M_bar_scale < 1.0 or not ways else []
        return (
            f"T_s = {1e3 * T_s:.3g} ms is too long for {robot.name} with this M̄: time-delay estimation lags, "
            f"and the robot swings. Choose {', '.join(ways)}, or a controller with a model, such as osf."
        )
    lag = 0.0 if longest == math.inf else 0.5 / _bandwidth(robot, settings, T_s)
    for task in (task for level in settings.levels if level.enabled for task in level.tasks):
        if np.any(lag * np.asarray(task.K_p) > task.K_v):
            return (
                f"K_p of {task.name} is too large for {robot.name} with this K_v, M̄ and T_s: time-delay "
                f"estimation lags by {1e3 * lag:.2g} ms, and the robot swings. Choose a smaller K_p, a "
                "larger K_v or a shorter T_s."
            )
    return _too_coarse(robot, settings) if longest < math.inf and settings.plant.saturate else ""


def _too_coarse(robot: Robot, settings: TorqueSettings) -> str:
    limits, resolution = settings.limits, encoder_resolution(robot, settings.plant)
    change = np.array(settings.M_bar) * settings.M_bar_scale * resolution / settings.T_s**2
    bound = robot.tau_limit * (min(limits.torque_scale, 1.0) if limits.torque else 1.0)
    worst = int(np.argmax(change / bound))
    if change[worst] <= bound[worst]:
        return ""
    return (
        f"One digit of the encoder of {robot.joint_names[worst]} changes the torque by M̄ δ/T_s² = "
        f"{change[worst]:.3g} N·m, and the limit is {bound[worst]:.3g} N·m: the robot shakes, and may not "
        "keep its distances. Choose a longer T_s, a smaller M̄ or finer encoders."
    )


def check_period(robot: Robot, settings: TorqueSettings) -> None:
    """Raises InputError if T_s is longer than `USUAL` and than `longest_period`."""
    if settings.T_s > USUAL and settings.T_s > longest_period(robot, settings):
        raise InputError(warning(robot, settings))


def _bandwidth(robot: Robot, settings: TorqueSettings, T_s: float) -> float:
    model = true_model(robot, settings.plant)
    M_bar = np.array(settings.M_bar, dtype=float) * settings.M_bar_scale
    return tracking_bandwidth(mass_matrix(model, model.createData(), robot.home), M_bar, T_s)
