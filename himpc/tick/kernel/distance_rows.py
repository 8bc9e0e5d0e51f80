"""The rows that keep distances, see `limits.distance`: the choice of pairs, their directions and bounds."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import GIVEN_VECTOR, INDICES, NUMBER, VECTOR, WHOLE, inline_kernel, kernel
from himpc.constants import FADE, RETREAT, RETURN_RATE, WITHIN
from himpc.tick.kernel.arrays import DIRECTED, PERIOD, T_S, Array, IntArray, TickArrays, arrays_of
from himpc.tick.kernel.kinematics import forward_kinematics
from himpc.tick.kernel.near import find_near
from himpc.tick.kernel.pair_arrays import PairArrays, pair_arrays_of


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
def approach(d: PairArrays, pair: int) -> float:
    """Returns the speed at which the motion of a pair's object reduces the pair's distance, m/s."""
    moving = 0.0
    for a in range(3):
        moving += d.normal[pair, a] * d.velocity[d.shape[pair], a]
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


@inline_kernel
def find_pairs(d: PairArrays, q: Array, within: float) -> int:
    """Finds the pairs nearer than `within`, m, at the positions q, (n,); returns their number."""
    forward_kinematics(
        *(q, d.parent, d.is_revolute, d.column, d.factor, d.rotation, d.translation, d.axis),
        *(d.placed[0], d.z[0]),
    )
    return find_near(
        *(d.placed, d.z, d.is_revolute, d.column, d.factor, d.carries, d.joint, d.centre, d.span, d.radius),
        *(d.kind, d.carrier, d.turn, d.middle, d.half, d.thickness, d.meets, within, d.centres, d.spans),
        *(d.knot, d.sphere, d.shape, d.share_of_span, d.distance, d.normal, d.slopes),
    )


@inline_kernel
def choose_pairs(d: PairArrays, q: Array) -> int:
    """Finds the pairs at the positions q, (n,), and chooses those that can soonest reach the distance that
    they must keep, see `soonest`. It chooses at most R, sorts them by distance, and returns their number. A
    near pair whose distance hardly changes is not chosen if farther pairs can approach faster.

    `chosen`, `link`, `other`, `share`, `moving` and `about` are the result.
    """
    d.about[ROOM], d.about[FASTEST], d.about[CHANGED] = math.inf, 0.0, 0.0
    count, chosen = find_pairs(d, q, WITHIN), d.chosen
    for r in range(count):
        room = d.distance[r] - d.numbers[0] * d.shares[d.shape[r], d.sphere[r]]
        d.about[ROOM] = min(d.about[ROOM], room)
        d.time[r] = soonest(room, d.slopes[r], d.fastest, approach(d, r))
    number = min(count, chosen.size)
    for c in range(number):
        best = -1
        for r in range(count):
            if d.time[r] < math.inf and (best < 0 or d.time[r] < d.time[best]):
                best = r
        if best < 0:
            number = c
            break
        d.time[best] = math.inf
        rank = c
        while rank > 0 and d.distance[chosen[rank - 1]] > d.distance[best]:
            chosen[rank] = chosen[rank - 1]
            rank -= 1
        chosen[rank] = best
    for c in range(chosen.size):
        s, o = (d.sphere[chosen[c]], d.shape[chosen[c]]) if c < number else (-1, -1)
        if d.link[c] != s or d.other[c] != o:
            d.link[c], d.other[c], d.about[CHANGED] = s, o, 1.0
        d.moving[c] = 0.0
        if c < number:
            d.share[c], d.moving[c] = d.shares[o, s], approach(d, chosen[c])
            d.about[FASTEST] = max(d.about[FASTEST], abs(d.moving[c]))
    return number


@inline_kernel
def write_distance_rows(t: TickArrays, d: PairArrays, block: int) -> None:
    """Chooses pairs at the measured state, and writes their rows into `direction`, `lower` and `upper`.

    block: index of the set of directions for distances.
    """
    count = choose_pairs(d, t.q)
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
        gradient = d.slopes[d.chosen[c]]
        squares, speed, gained = 0.0, 0.0, 0.0
        for a in range(n):
            squares += (gradient[a] / t.M_bar[a]) ** 2
            speed += gradient[a] * t.v[a]
            gained += gradient[a] * (t.v[a] - t.v_was[a]) / period
        length = math.sqrt(squares)
        gap: Any = d.distance[d.chosen[c]]
        d_safe, margin = d.share[c] * d.numbers[0], d.share[c] * d.numbers[1]
        rate = d.moving[c] + least_rate(gap, d_safe, margin, d.numbers[2], d.numbers[3])
        if length == 0.0 or not math.isfinite(rate):
            continue
        for a in range(n):
            D[c, a] = gradient[a] / (t.M_bar[a] * length)
        for j in range(N):
            t.lower[first + j, c] = (t.approach[j] * (rate - speed) - T_s * (j + 1.0) * gained) / (
                T_s * length
            )


@kernel(VECTOR, INDICES, INDICES, INDICES, GIVEN_VECTOR, NUMBER)
def near_pairs(
    pairs: Array, pairs_where: IntArray, whole: IntArray, whole_where: IntArray, q: Array, within: float
) -> int:
    """Applies `find_pairs` to the arrays of an arena of pairs."""
    return find_pairs(pair_arrays_of(pairs, pairs_where, whole, whole_where), q, within)


@kernel(VECTOR, INDICES, INDICES, INDICES, GIVEN_VECTOR)
def chosen_pairs(
    pairs: Array, pairs_where: IntArray, whole: IntArray, whole_where: IntArray, q: Array
) -> int:
    """Applies `choose_pairs` to the arrays of an arena of pairs."""
    return choose_pairs(pair_arrays_of(pairs, pairs_where, whole, whole_where), q)


@kernel(VECTOR, INDICES, INDICES, INDICES, VECTOR, INDICES, INDICES, INDICES, WHOLE)
def distance_rows(
    data: Array,
    where: IntArray,
    whole: IntArray,
    whole_where: IntArray,
    pairs: Array,
    pairs_where: IntArray,
    pairs_whole: IntArray,
    pairs_whole_where: IntArray,
    block: int,
) -> None:
    """Applies `write_distance_rows` to the arrays of a tick and of its pairs."""
    d = pair_arrays_of(pairs, pairs_where, pairs_whole, pairs_whole_where)
    write_distance_rows(arrays_of(data, where, whole, whole_where), d, block)
