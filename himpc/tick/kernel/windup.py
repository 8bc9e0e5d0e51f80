"""Brings a robot to rest that presses: its torque rises although its joints are still, or a contact moves
them.

Time-delay estimation counts the force of a contact as a disturbance, and presses harder in every period. Its
torque then rises although no joint moves. A change of the torque of a moving robot (gravity in another
posture) is forgotten at the rate max|q̇| / FORGETS. If the remaining change exceeds PRESSING, the robot is
stopped while the change grows, and until a reference moves. A robot with a joint that a contact carries
beyond CARRIED times its velocity limit is stopped as well.
"""

from __future__ import annotations

import math

from himpc.compilation.compiled import FLAG, GIVEN_VECTOR, NUMBER, VECTOR, inline_kernel, kernel, plain
from himpc.tick.kernel.arrays import Array

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
TREND, FREE = range(2)
"""Indices of the numbers about the wind-up: the mean of the rate at which ½‖wound‖² grows, per period; 1 if
the robot is free and 0 if it is stopped."""


@inline_kernel
def taken_back(M_bar: float, v_limit: float, T_s: float) -> float:
    """Returns the largest torque with which a joint may press, M̄ q̇_max / T_s, N·m.

    If a contact with the torque τ is lost, the joints accelerate with a₀ = M⁻¹ τ. Time-delay estimation
    takes the torque back by Δτ = −M̄ a in every period, so that a = (1 − M⁻¹ M̄)ᵏ a₀ after k periods. The sum
    over all periods is the velocity that is gained: T_s (M⁻¹ M̄)⁻¹ M⁻¹ τ = T_s M̄⁻¹ τ. It does not depend on
    the true inertia M.

    Args:
        M_bar: kg·m². v_limit: of the robot's joint, rad/s. T_s: control period, s.
    """
    return M_bar * v_limit / T_s


@inline_kernel
def resist_windup(
    M_bar: Array,
    v_limit: Array,
    tau: Array,
    v: Array,
    moves: bool,
    T_s: float,
    tau_before: Array,
    wound: Array,
    windup: Array,
    slower: Array,
) -> float:
    """Updates the wind-up by one control period, and lowers the velocity limits of a robot that presses.
    Returns the largest error on which tasks act, m or rad, see `Avoidance.pull`.

    Args:
        M_bar: (n,) kg·m². v_limit: of the robot, (n,) rad/s.
        tau: torque that acts, (n,) N·m. v: measured, (n,) rad/s.
        moves: whether a reference moves. T_s: control period, s.
        tau_before: (n,) N·m, the torque that acted one period ago; updated.
        wound: (n,) change of the torque while the joints were still, as a share of `taken_back`; updated.
        windup: numbers about the wind-up, see TREND; updated.
        slower: (n,) rad/s, the velocity limits in force; lowered.
    """
    n = len(v)
    fastest, carried = 0.0, False
    for a in range(n):
        fastest = max(fastest, abs(v[a]))
        carried = carried or abs(v[a]) > CARRIED * v_limit[a]
    growth, most, forgotten = 0.0, 0.0, math.exp(-fastest * T_s / FORGETS)
    for a in range(n):
        change = (tau[a] - tau_before[a]) / taken_back(M_bar[a], v_limit[a], T_s)
        wound[a] = (wound[a] + change) * forgotten
        tau_before[a] = tau[a]
        growth += change * wound[a]
        most = max(most, abs(wound[a]))
    windup[TREND] += min(1.0, T_s / TREND_SECONDS) * (growth - windup[TREND])
    presses = carried or (most >= PRESSING and (windup[TREND] > 0.0 or not moves))
    goal, seconds = (0.0, STOPPING) if presses else (1.0, RELEASE)
    windup[FREE] += min(1.0, T_s / seconds) * (goal - windup[FREE])
    if windup[FREE] > 1.0 - 1e-6:
        return math.inf
    for a in range(n):
        creep = min(slower[a], CREEP)
        slower[a] = creep + windup[FREE] * (min(slower[a], 1e3) - creep)
    return WEAK_PULL * windup[FREE] + 1e-9


resist_windup_of = kernel(
    *(VECTOR, VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, FLAG, NUMBER, VECTOR, VECTOR, VECTOR, VECTOR)
)(plain(resist_windup))
"""`resist_windup` for callers in Python."""
