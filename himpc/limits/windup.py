"""Brings a robot to rest that presses: its torque rises although its joints are still, or a contact moves
them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.limits.limits import LimitsInForce

Array = NDArray[np.float64]

PRESSING = 0.5
"""Share of a velocity limit that a joint would gain if the contact were lost. If it is larger, the robot
presses against something. The largest share that was measured on robots that touch nothing is 0.39."""
CARRIED = 1.2
"""Share of a velocity limit of the robot. A free robot's joints stay below this; a joint that is faster is
moved by a contact."""
FORGETS = 1.0
"""rad (m): a change of the torque is forgotten while the robot moves by this."""
TREND_SECONDS = 0.03
"""s: time constant of the mean that tells whether a robot presses harder."""
STOPPING, RELEASE = 0.02, 0.05
"""s: time constants with which a robot that presses is stopped and released."""
CREEP = 1e-3
"""rad/s: the velocity limit of a stopped robot's joint is not reduced below this."""
WEAK_PULL = 0.05
"""m: the largest error on which tasks of a robot act that begins to press, see `Avoidance.pull`."""


class Windup(NamedTuple):
    """The degree to which time-delay estimation has wound up the torque.

    Attributes:
        tau: (n,) N·m, the torque that acted one period ago.
        wound: (n,) change of the torque while the joints were still, as a share of `taken_back`.
        trend: mean of the rate at which ½‖wound‖² grows, per period.
        share: 1 if the robot is free, 0 if it is stopped.
    """

    tau: Array
    wound: Array
    trend: float
    share: float


def free(tau: Array) -> Windup:
    """Returns the state of a robot that does not press. tau: (n,) N·m, the torque that acts."""
    return Windup(tau, np.zeros_like(tau), 0.0, 1.0)


def taken_back(M_bar: Array, v_limit: Array, T_s: float) -> Array:
    """Returns the largest torque with which a joint may press, M̄ q̇_max / T_s, (n,) N·m.

    If a contact with the torque τ is lost, the joints accelerate with a₀ = M⁻¹ τ. Time-delay estimation
    takes the torque back by Δτ = −M̄ a in every period, so that a = (1 − M⁻¹ M̄)ᵏ a₀ after k periods. The sum
    over all periods is the velocity that is gained: T_s (M⁻¹ M̄)⁻¹ M⁻¹ τ = T_s M̄⁻¹ τ. It does not depend on
    the true inertia M.

    Args:
        M_bar: (n,) kg·m². v_limit: of the robot, (n,) rad/s. T_s: control period, s.
    """
    return M_bar * v_limit / T_s


def wound_up(
    before: Windup, tau: Array, v: Array, largest: Array, v_limit: Array, moves: bool, T_s: float
) -> Windup:
    """Returns the wind-up one period later.

    Time-delay estimation counts the force of a contact as a disturbance, and presses harder in every period.
    Its torque then rises although no joint moves. A change of the torque of a moving robot (gravity in
    another posture) is forgotten at the rate max|q̇| / FORGETS. If the remaining change exceeds PRESSING, the
    robot is stopped while the change grows, and until a reference moves. A robot with a joint that a contact
    carries beyond CARRIED times its velocity limit is stopped as well.

    Args:
        before: the wind-up one period ago.
        tau: torque that acts, (n,) N·m.
        v: measured, (n,) rad/s.
        largest: the result of `taken_back`.
        v_limit: of the robot, (n,) rad/s.
        moves: whether a reference moves.
        T_s: control period, s.
    """
    change = (tau - before.tau) / largest
    wound = (before.wound + change) * math.exp(-float(np.abs(v).max()) * T_s / FORGETS)
    trend = before.trend + min(1.0, T_s / TREND_SECONDS) * (float(change @ wound) - before.trend)
    presses = float(np.abs(wound).max()) >= PRESSING and (trend > 0.0 or not moves)
    presses = presses or bool((np.abs(v) > CARRIED * v_limit).any())
    goal, seconds = (0.0, STOPPING) if presses else (1.0, RELEASE)
    return Windup(tau, wound, trend, before.share + min(1.0, T_s / seconds) * (goal - before.share))


def stopped(limits: LimitsInForce, windup: Windup) -> LimitsInForce:
    """Returns the limits in force, with the lower velocity limits of a robot that presses."""
    if windup.share > 1.0 - 1e-6:
        return limits
    creep = np.minimum(limits.v_limit, CREEP)
    return limits.with_velocities(creep + windup.share * (np.minimum(limits.v_limit, 1e3) - creep))


def largest_error(windup: Windup) -> float:
    """Returns the largest error on which tasks act, m or rad, see `Avoidance.pull`."""
    return math.inf if windup.share > 1.0 - 1e-6 else WEAK_PULL * windup.share + 1e-9
