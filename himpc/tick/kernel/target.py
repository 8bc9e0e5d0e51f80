"""Entry point: the filter of a dragged target, see `references.target`."""

from __future__ import annotations

import math

from himpc.compilation.compiled import GIVEN_MATRICES, MATRIX, NUMBER, VECTOR, WHOLE, inline_kernel, kernel
from himpc.compilation.views import matrix
from himpc.constants import APPROACH_RATE, STILL, VELOCITY_RATE
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.kinematics import rotation_error
from himpc.tick.kernel.linear import copy, dot


@inline_kernel
def shorten(x: Array, cap: float, m: int) -> None:
    """Shortens x to the length `cap` if it is longer."""
    length = math.sqrt(dot(x, x, m))
    if length > cap:
        for a in range(m):
            x[a] *= cap / length


@inline_kernel
def rotate(w: Array, now: Array, then: Array) -> None:
    """Computes exp(w) R of a rotation R by Rodrigues' formula; rotations are stored row by row."""
    angle = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    half = math.sin(0.5 * angle)
    first = math.sin(angle) / angle if angle > 1e-9 else 1.0
    second = 2.0 * half * half / (angle * angle) if angle > 1e-9 else 0.5
    for c in range(3):
        x, y, z = now[c], now[3 + c], now[6 + c]
        a, b, d = w[1] * z - w[2] * y, w[2] * x - w[0] * z, w[0] * y - w[1] * x
        then[c] = x + first * a + second * (w[1] * d - w[2] * b)
        then[3 + c] = y + first * b + second * (w[2] * a - w[0] * d)
        then[6 + c] = z + first * d + second * (w[0] * b - w[1] * a)


@inline_kernel
def jerked(
    velocity: Array,
    acceleration: Array,
    wanted: Array,
    speed: float,
    caps: Array,
    T_s: float,
    m: int,
    change: Array,
) -> None:
    """Computes the change of the acceleration in one period towards the desired acceleration, within the jerk
    cap. The speed must not exceed its cap: the acceleration along the motion stays below √(jerk · speed
    left). On a straight line twice this acceleration would be possible, but on a curve other components of
    the acceleration increase the speed too. If the acceleration is above this limit, the jerk is first used
    to reduce it.
    """
    budget = caps[2] * T_s
    if speed == 0.0:
        for a in range(m):
            change[a] = wanted[a] - acceleration[a]
        shorten(change, budget, m)
        return
    most = math.sqrt(caps[2] * max(caps[0] - speed, 0.0))
    excess = max(dot(wanted, velocity, m) / speed - most, 0.0)
    for a in range(m):
        change[a] = wanted[a] - excess * (velocity[a] / speed) - acceleration[a]
    if dot(acceleration, velocity, m) / speed <= most:
        shorten(change, budget, m)
        return
    share = dot(change, velocity, m) / speed
    along = max(share, -budget)
    for a in range(m):
        change[a] -= share * (velocity[a] / speed)
    shorten(change, math.sqrt(max(budget * budget - along * along, 0.0)), m)
    for a in range(m):
        change[a] += along * (velocity[a] / speed)


@inline_kernel
def slowed(along: Array, velocity: Array, acceleration: Array, caps: Array, T_s: float, m: int) -> None:
    """Reduces the velocity `along`, which the jerk cap allows, to the speed cap. It is shortened if the jerk
    cap allows this, too. Otherwise it moves towards the slowest velocity that the jerk cap allows, until it
    meets the speed cap."""
    length, radius = math.sqrt(dot(along, along, m)), caps[2] * T_s * T_s
    if length <= caps[0]:
        return
    shorter, away, slow = caps[0] / length, 0.0, 0.0
    for a in range(m):
        unchanged = velocity[a] + T_s * acceleration[a]
        away += (shorter * along[a] - unchanged) ** 2
        slow += unchanged * unchanged
    slow = math.sqrt(slow)
    if away <= radius * radius * (1.0 + 1e-9) or slow <= radius:
        for a in range(m):
            along[a] *= shorter
        return
    # |along + share (slowest − along)| = speed cap.
    square, product = 0.0, 0.0
    for a in range(m):
        step = (velocity[a] + T_s * acceleration[a]) * (1.0 - radius / slow) - along[a]
        square += step * step
        product += along[a] * step
    root = math.sqrt(max(product * product - square * (length * length - caps[0] * caps[0]), 0.0))
    share = min((-product - root) / square, 1.0)
    for a in range(m):
        step = (velocity[a] + T_s * acceleration[a]) * (1.0 - radius / slow) - along[a]
        along[a] += share * step


@inline_kernel
def following(now: Array, then: Array, raw: Array, caps: Array, T_s: float, m: int, width: int) -> None:
    """Computes the next sample: one period of constant acceleration within the caps."""
    velocity, acceleration = now[width : width + m], now[width + m : width + 2 * m]
    away, change, along = caps[3 : 3 + m], caps[3 + m : 3 + 2 * m], caps[3 + 2 * m : 3 + 3 * m]
    rests = now[width + 3 * m] > 0.0
    for a in range(m):
        away[a] = 0.0 if rests or width > m else raw[a] - now[a]
    if width > m and not rests:
        rotation_error(matrix(raw, 0, 3, 3), matrix(now, 0, 3, 3), away)
    distance, speed = math.sqrt(dot(away, away, m)), math.sqrt(dot(velocity, velocity, m))
    if rests or (distance < STILL and speed < 10.0 * STILL):
        copy(raw, then, width)
        then[width:] = 0.0
        copy(away, then[width + 2 * m :], m)
        then[width + 3 * m] = 1.0
        return
    # The speed allows a stop with half the acceleration cap; near the goal it is proportional to the
    # distance.
    wanted = min(caps[0], APPROACH_RATE * distance, math.sqrt(caps[1] * distance))
    for a in range(m):
        goal = away[a] * (wanted / distance) if distance > 0.0 else 0.0
        along[a] = VELOCITY_RATE * (goal - velocity[a])
    shorten(along, caps[1], m)
    jerked(velocity, acceleration, along, speed, caps, T_s, m, change)
    for a in range(m):
        along[a] = velocity[a] + T_s * (acceleration[a] + change[a])
    slowed(along, velocity, acceleration, caps, T_s, m)
    for a in range(m):
        then[width + a] = along[a]
        then[width + m + a] = (along[a] - velocity[a]) / T_s
        then[width + 2 * m + a] = 0.5 * T_s * (velocity[a] + along[a])
    then[width + 3 * m] = 0.0
    step = then[width + 2 * m :]
    if width > m:
        rotate(step, now, then)
    else:
        for a in range(m):
            then[a] = now[a] + step[a]


@kernel(MATRIX, WHOLE, VECTOR, VECTOR, NUMBER, GIVEN_MATRICES)
def roll(samples: Array, known: int, raw: Array, caps: Array, T_s: float, out: Array) -> None:
    """Advances the filter with a constant raw target, and collects its preview.

    Args:
        samples: (…, w + 3m + 1) value, velocity, acceleration, displacement from the previous sample, and 1
            if the target rests at the raw target. A value has w = 9 numbers for a rotation, else m.
        known: number of samples that exist; the other samples for `out` are computed.
        raw: the raw target, (w,).
        caps: speed, acceleration and jerk; then scratch for 3m numbers.
        T_s: s.
        out: (3, N+1, m) displacement, velocity and acceleration at t … t + N·T_s.
    """
    m, width = out.shape[2], raw.size
    for j in range(known, out.shape[1]):
        following(samples[j - 1], samples[j], raw, caps, T_s, m, width)
    for j in range(out.shape[1]):
        row = samples[j, width:]
        for a in range(m):
            out[0, j, a] = out[0, j - 1, a] + row[2 * m + a] if j else 0.0
            out[1, j, a], out[2, j, a] = row[a], row[m + a]
