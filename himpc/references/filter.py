"""The filter of a dragged target in Python; `himpc.tick.kernel.target` contains the compiled filter."""

from __future__ import annotations

import math

import numpy as np

from himpc.constants import APPROACH_RATE, STILL, VELOCITY_RATE
from himpc.references.preview import Array
from himpc.rotation import exp3, log3


def roll(samples: Array, known: int, raw: Array, caps: Array, T_s: float, out: Array) -> None:
    """Computes future states of the filter with the raw target constant, and writes them as a preview.

    Args:
        samples: (…, w + 3m + 1), one row per sample: value, velocity, acceleration, displacement from the
            sample before, and whether the value rests at the raw target. A value has w = 9 numbers for a
            rotation, otherwise w = m.
        known: number of samples that are already computed. Further samples are computed up to the length of
            `out`.
        raw: the raw target, (w,).
        caps: the first three entries are the largest speed, acceleration and jerk.
        T_s: control period, s.
        out: (3, N+1, m) displacement, velocity and acceleration at t … t + N·T_s.
    """
    count, m = out.shape[1:]
    for j in range(known, count):
        samples[j] = _following(samples[j - 1], raw, caps[:3].tolist(), T_s, m)
    rows = samples[:count, raw.size : raw.size + 3 * m]
    velocity, acceleration, way = rows[:, :m], rows[:, m : 2 * m], rows[:, 2 * m :]
    out[0, 0] = 0.0
    np.cumsum(way[1:], axis=0, out=out[0, 1:])
    out[1], out[2] = velocity, acceleration


def _following(now: Array, raw: Array, caps: list[float], T_s: float, m: int) -> Array:
    """Returns the sample that follows `now`, after one period of constant acceleration within the caps."""
    most_speed, most_acceleration, _ = caps
    w = raw.size
    value, velocity, acceleration = now[:w], now[w : w + m], now[w + m : w + 2 * m]
    rests, rotates = now[-1] > 0.0, w > m
    away = log3(raw.reshape(3, 3) @ value.reshape(3, 3).T) if rotates else raw - value
    distance, speed = _norm(away), _norm(velocity)
    if rests or (distance < STILL and speed < 10.0 * STILL):
        return np.concatenate([raw, np.zeros(2 * m), np.zeros(m) if rests else away, [1.0]])
    # The target can always stop at the goal with half the acceleration cap. Near the goal, the speed is
    # proportional to the distance.
    wanted = min(most_speed, APPROACH_RATE * distance, math.sqrt(most_acceleration * distance))
    goal = away * (wanted / distance) if distance > 0.0 else np.zeros(m)
    wish = _shortened(VELOCITY_RATE * (goal - velocity), most_acceleration)
    change = _jerked(velocity, acceleration, wish, caps, T_s)
    later = _shortened(velocity + T_s * (acceleration + change), most_speed)
    way = 0.5 * T_s * (velocity + later)
    moved = (exp3(way) @ value.reshape(3, 3)).ravel() if rotates else value + way
    return np.concatenate([moved, later, (later - velocity) / T_s, way, [0.0]])


def _jerked(velocity: Array, acceleration: Array, wish: Array, caps: list[float], T_s: float) -> Array:
    """Returns the change of the acceleration in one period towards the desired one, within the jerk cap.

    The speed must not exceed its cap. Along the motion the acceleration stays below √(jerk · (cap − speed)).
    On a straight line twice this value would be possible, but on a curve other components of the acceleration
    increase the speed too. If the acceleration already exceeds this limit, the jerk first reduces the
    acceleration.
    """
    most_speed, _, most_jerk = caps
    budget, speed = most_jerk * T_s, _norm(velocity)
    if speed == 0.0:
        return _shortened(wish - acceleration, budget)
    along = velocity / speed
    most = math.sqrt(most_jerk * max(most_speed - speed, 0.0))
    change = wish - max(float(wish @ along) - most, 0.0) * along - acceleration
    if float(acceleration @ along) <= most:
        return _shortened(change, budget)
    share = float(change @ along)
    first = max(share, -budget)
    rest = _shortened(change - share * along, math.sqrt(max(budget * budget - first * first, 0.0)))
    return rest + first * along


def _shortened(x: Array, cap: float) -> Array:
    """Returns x, scaled down to the norm `cap` if its norm is larger."""
    length = _norm(x)
    return x * (cap / length) if length > cap else x


def _norm(x: Array) -> float:
    return math.sqrt(float(x @ x))
