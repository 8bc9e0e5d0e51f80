"""References as numbers: x̄_d = col(x_d, ẋ_d, ẍ_d) of (28) over the horizon."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import Array, IntArray

SAMPLED, UNIFORM, EASED = range(3)
"""The source of a task's reference: samples that Python wrote, or a curve whose phase is φ = ωt + φ₀ or φ =
ωt − sin ωt + φ₀."""


@inline_kernel
def curves(
    t: float,
    T_s: float,
    task: IntArray,
    law: IntArray,
    pace: Array,
    curve: Array,
    x_d: Array,
    displacement: Array,
    velocity_d: Array,
    acceleration_d: Array,
) -> None:
    """Computes x_d = c + a cos φ + b sin φ + d sin 2φ of every task that follows a curve, at t, t + T_s, …
    (s).

    Args:
        t, T_s: s.
        task: the table of tasks, see `jacobian`.
        law: (T,) SAMPLED, UNIFORM or EASED.
        pace: (T, 2) ω (rad/s) and φ₀ (rad) of each task.
        curve: (M, 4) c, a, b, d of each row.
        x_d: (M,), at t.
        displacement, velocity_d, acceleration_d: (N+1, M): x_d(k+j) − x_d(k), ẋ_d and ẍ_d.
    """
    for k in range(len(law)):
        if law[k] == SAMPLED:
            continue
        first, omega = task[k, 2], pace[k, 0]
        last = first + task[k, 3]
        for j in range(len(displacement)):
            turned = omega * (t + T_s * j)
            phi, rate, change = turned + pace[k, 1], omega, 0.0
            if law[k] == EASED:
                phi -= math.sin(turned)
                rate = omega * (1.0 - math.cos(turned))
                change = omega * omega * math.sin(turned)
            cos, sin = math.cos(phi), math.sin(phi)
            cos_2, sin_2 = cos * cos - sin * sin, 2.0 * sin * cos
            for i in range(first, last):
                a, b, d = curve[i, 1], curve[i, 2], curve[i, 3]
                x = curve[i, 0] + a * cos + b * sin + d * sin_2
                slope = b * cos - a * sin + 2.0 * d * cos_2
                bend = -a * cos - b * sin - 4.0 * d * sin_2
                if j == 0:
                    x_d[i] = x
                displacement[j, i] = x - x_d[i]
                velocity_d[j, i] = rate * slope
                acceleration_d[j, i] = change * slope + rate * rate * bend
