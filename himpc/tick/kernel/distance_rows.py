"""The rows that keep distances, see `limits.distance`: the choice of pairs, their directions and bounds."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import INDICES, MATRIX, NUMBER, VECTOR, WHOLE, inline_kernel, kernel
from himpc.compilation.views import borrowed
from himpc.constants import FADE, RETREAT, RETURN_RATE, WITHIN
from himpc.tick.kernel.arrays import DIRECTED, PERIOD, T_S, Array, IntArray, arrays_of


@inline_kernel
def least_rate(distance: float, d_safe: float, margin: float, reaction: float, deceleration: float) -> float:
    """Returns the least rate of a distance, m/s, see `limits.distance.least_rates`."""
    room = distance - d_safe - margin
    if room <= 0.0:
        return -max(RETURN_RATE * min(distance - d_safe, 0.0), -RETREAT)
    stop = deceleration * (math.sqrt(reaction * reaction + 2.0 / deceleration * room) - reaction)
    fade = min(max((WITHIN - distance) / FADE, 0.0), 1.0)
    return -stop / fade if fade > 0.0 else -math.inf


ROOM, FASTEST, CHANGED = range(3)
"""Numbers about the pairs. ROOM: the smallest difference between a pair's distance and the distance that the
pair must keep, m. FASTEST: the largest speed at which an object of a chosen pair moves towards or away from
the link, m/s. CHANGED: 1 if other pairs are chosen than before."""


@inline_kernel
def approach(pair: int, other: int, normal: Array, velocity: Array) -> float:
    """Returns the speed at which the motion of a pair's object reduces the pair's distance, m/s.

    Args:
        pair: index of the pair.
        other: index of the pair's second shape; only the first b shapes are objects.
        normal: unit vectors of all pairs, see `near`.
        velocity: (b, 3) m/s, velocities of the objects.
    """
    moving = 0.0
    if other < len(velocity):
        for a in range(3):
            moving += normal[pair, a] * velocity[other, a]
    return moving


@inline_kernel
def soonest(room: float, slope: Any, fastest: Array, moving: float) -> float:
    """Returns the shortest time, s, in which a pair can come to the smallest distance that it must keep. For
    a pair that is already nearer than this distance, it returns `room`, which is then negative.

    Args:
        room: the pair's distance minus the smallest distance that it must keep, m.
        slope: (n,) m/rad, gradient of the distance.
        fastest: (n,) rad/s, the largest speeds of the joints.
        moving: speed at which the object's motion reduces the distance, m/s.
    """
    if room <= 0.0:
        return room
    speed = max(moving, 0.0)
    for j in range(fastest.size):
        speed += abs(slope[j]) * fastest[j]
    return room / speed if speed > 0.0 else math.inf


@kernel(
    *(WHOLE, VECTOR, INDICES, INDICES, MATRIX, MATRIX, MATRIX, MATRIX, VECTOR, NUMBER),
    *(VECTOR, INDICES, INDICES, INDICES, VECTOR, VECTOR, VECTOR),
)
def nearest(
    count: int,
    distance: Array,
    sphere: IntArray,
    shape: IntArray,
    normal: Array,
    slopes: Array,
    shares: Array,
    velocity: Array,
    fastest: Array,
    d_safe: float,
    time: Array,
    chosen: IntArray,
    links: IntArray,
    others: IntArray,
    share: Array,
    moving: Array,
    about: Array,
) -> int:
    """Chooses those of `count` pairs that can soonest reach the distance that they must keep, see `soonest`.
    It chooses at most as many as `chosen` can contain, sorts them by distance, and returns their number. A
    near pair whose distance hardly changes is not chosen if farther pairs can approach faster.

    Args:
        count, distance, sphere, shape, normal, slopes: of all pairs, see `near`.
        shares: (B, S) share of d_safe and the margin that each pair keeps.
        velocity: (b, 3) m/s, velocities of the first b shapes, which are objects.
        fastest: (n,) rad/s, the largest speeds of the joints.
        d_safe: m.
        time: scratch, one per pair.
        chosen: indices of the chosen pairs; the result.
        links, others: `sphere` and `shape` of each chosen pair, −1 where there is none; updated.
        share, moving: of each chosen pair, see `distance_rows`; the result.
        about: numbers about the pairs, see ROOM; the result.
    """
    slopes = borrowed(slopes)
    about[ROOM], about[FASTEST], about[CHANGED] = math.inf, 0.0, 0.0
    for r in range(count):
        room = distance[r] - d_safe * shares[shape[r], sphere[r]]
        about[ROOM] = min(about[ROOM], room)
        time[r] = soonest(room, slopes[r], fastest, approach(r, shape[r], normal, velocity))
    number = min(count, chosen.size)
    for c in range(number):
        best = -1
        for r in range(count):
            if time[r] < math.inf and (best < 0 or time[r] < time[best]):
                best = r
        if best < 0:
            number = c
            break
        time[best] = math.inf
        rank = c
        while rank > 0 and distance[chosen[rank - 1]] > distance[best]:
            chosen[rank] = chosen[rank - 1]
            rank -= 1
        chosen[rank] = best
    for c in range(chosen.size):
        s, o = (sphere[chosen[c]], shape[chosen[c]]) if c < number else (-1, -1)
        if links[c] != s or others[c] != o:
            links[c], others[c], about[CHANGED] = s, o, 1.0
        moving[c] = 0.0
        if c < number:
            share[c], moving[c] = shares[o, s], approach(chosen[c], o, normal, velocity)
            about[FASTEST] = max(about[FASTEST], abs(moving[c]))
    return number


@kernel(VECTOR, INDICES, INDICES, INDICES, WHOLE, WHOLE, INDICES, VECTOR, MATRIX, VECTOR, VECTOR, VECTOR)
def distance_rows(
    data: Any,
    where: IntArray,
    whole: IntArray,
    whole_where: IntArray,
    block: int,
    count: int,
    chosen: IntArray,
    distance: Array,
    slopes: Array,
    moving: Array,
    share: Array,
    numbers: Array,
) -> None:
    """Writes the rows of pairs into `direction`, `lower` and `upper`.

    Args:
        data, where, whole, whole_where: the arena.
        block: index of the set of directions for distances.
        count: number of pairs that have rows. chosen: indices of these pairs.
        distance, slopes: of all pairs, see `near`.
        moving: speed at which the object's motion reduces the distance of each chosen pair, m/s.
        share: share of d_safe and the margin that each chosen pair keeps.
        numbers: d_safe and margin, m, reaction, s, and deceleration, m/s².
    """
    t = arrays_of(data, where, whole, whole_where)
    slopes = borrowed(slopes)
    N, n = t.fixed.shape
    T_s, period = t.scalars[T_S], t.scalars[PERIOD]
    first, D = len(t.L) - (t.sizes[DIRECTED] - block) * N, t.direction[block]
    for c in range(n):
        for a in range(n):
            D[c, a] = 0.0
        for j in range(N):
            t.lower[first + j, c], t.upper[first + j, c] = -math.inf, math.inf
        if c >= count:
            continue
        gradient = slopes[chosen[c]]
        squares, speed, gained = 0.0, 0.0, 0.0
        for a in range(n):
            squares += (gradient[a] / t.M_bar[a]) ** 2
            speed += gradient[a] * t.v[a]
            gained += gradient[a] * (t.v[a] - t.v_was[a]) / period
        length = math.sqrt(squares)
        d: Any = distance[chosen[c]]
        d_safe, margin = share[c] * numbers[0], share[c] * numbers[1]
        rate = moving[c] + least_rate(d, d_safe, margin, numbers[2], numbers[3])
        if length == 0.0 or not math.isfinite(rate):
            continue
        for a in range(n):
            D[c, a] = gradient[a] / (t.M_bar[a] * length)
        for j in range(N):
            t.lower[first + j, c] = (t.approach[j] * (rate - speed) - T_s * (j + 1.0) * gained) / (
                T_s * length
            )
