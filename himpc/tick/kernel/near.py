"""Compiled signed distances between capsules and shapes, with gradients. A capsule contains all points that
are nearer than its radius to a segment; a sphere is a capsule whose segment has length 0."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from himpc.compilation.compiled import (
    INDICES,
    MATRICES,
    MATRIX,
    NUMBER,
    TABLE,
    VECTOR,
    inline_kernel,
    kernel,
    plain,
)
from himpc.compilation.views import borrowed
from himpc.tick.kernel.kinematics import add, points
from robots.collision import BALL, BOX, CAPSULE, FLOOR

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Vector3 = tuple[float, float, float]

_GOLDEN = 0.6180339887498949
_NARROWER = 40
"""Number of steps of the golden-section search. They reduce the searched part to a share of 4e-9 of the
segment."""
_PARALLEL = 1e-9
"""Square of the sine of the angle below which segments count as parallel."""


@inline_kernel
def _clipped(x: float) -> float:
    return min(max(x, 0.0), 1.0)


@inline_kernel
def from_ball(x: float, y: float, h: float, radius: float, u: Array) -> float:
    """Returns the distance of a point from a ball about the origin; u: the unit vector away from the ball."""
    away = math.sqrt(x * x + y * y + h * h)
    if away > 0.0:
        u[0], u[1], u[2] = x / away, y / away, h / away
    else:
        u[0], u[1], u[2] = 0.0, 0.0, 1.0
    return away - radius


@inline_kernel
def from_segment(x: float, y: float, h: float, e: Array, radius: float, u: Array) -> float:
    """Returns the distance of a point from a capsule about the segment 0 … e, with u as in `from_ball`."""
    ee = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
    s = _clipped((e[0] * x + e[1] * y + e[2] * h) / ee) if ee > 0.0 else 0.0
    return from_ball(x - s * e[0], y - s * e[1], h - s * e[2], radius, u)


@inline_kernel
def from_box(x: float, y: float, h: float, rotation: Array, half: Array, u: Array) -> float:
    """Returns the distance of a point from the nearest point of a box, with u as in `from_ball`. Inside the
    box, it returns minus the distance to the nearest face."""
    nearest, face, squares = -math.inf, 0, 0.0
    for a in range(3):
        out = abs(rotation[0, a] * x + rotation[1, a] * y + rotation[2, a] * h) - half[a]
        if out > nearest:
            nearest, face = out, a
        squares += max(out, 0.0) ** 2
    length = math.sqrt(squares)
    u[0] = u[1] = u[2] = 0.0
    for a in range(3):
        here = rotation[0, a] * x + rotation[1, a] * y + rotation[2, a] * h
        share = max(abs(here) - half[a], 0.0) / length if length > 0.0 else 0.0
        if length == 0.0 and a == face:
            share = 1.0
        for b in range(3):
            u[b] += rotation[b, a] * (share if here >= 0.0 else -share)
    return length if length > 0.0 else nearest


@inline_kernel
def _outside_box(x: float, y: float, h: float, rotation: Array, half: Array) -> float:
    """Returns the signed distance of a point from a box, see `from_box`."""
    nearest, squares = -math.inf, 0.0
    for a in range(3):
        out = abs(rotation[0, a] * x + rotation[1, a] * y + rotation[2, a] * h) - half[a]
        nearest = max(nearest, out)
        squares += max(out, 0.0) ** 2
    return math.sqrt(squares) if squares > 0.0 else nearest


@inline_kernel
def _along_box(p: Vector3, d: Vector3, rotation: Array, half: Array) -> float:
    """Returns the share of the segment p … p + d at which it is nearest to a box. The search requires that
    the signed distance is convex along a line; this is true for convex shapes."""
    low, high = 0.0, 1.0
    left, right = 1.0 - _GOLDEN, _GOLDEN
    f_left = _outside_box(p[0] + left * d[0], p[1] + left * d[1], p[2] + left * d[2], rotation, half)
    f_right = _outside_box(p[0] + right * d[0], p[1] + right * d[1], p[2] + right * d[2], rotation, half)
    for _ in range(_NARROWER):
        if f_left <= f_right:
            high, right, f_right = right, left, f_left
            left = high - _GOLDEN * (high - low)
            f_left = _outside_box(p[0] + left * d[0], p[1] + left * d[1], p[2] + left * d[2], rotation, half)
        else:
            low, left, f_left = left, right, f_right
            right = low + _GOLDEN * (high - low)
            f_right = _outside_box(
                p[0] + right * d[0], p[1] + right * d[1], p[2] + right * d[2], rotation, half
            )
    return 0.5 * (low + high)


@inline_kernel
def _along_segment(p: Vector3, d: Vector3, e: Array) -> float:
    """Returns the share of the segment p … p + d at which it is nearest to the segment 0 … e. For parallel
    segments this is the middle of the part where they are side by side."""
    dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    ee = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
    dp = d[0] * p[0] + d[1] * p[1] + d[2] * p[2]
    if ee == 0.0:
        return _clipped(-dp / dd)
    ep = e[0] * p[0] + e[1] * p[1] + e[2] * p[2]
    de = d[0] * e[0] + d[1] * e[1] + d[2] * e[2]
    square = dd * ee - de * de
    if square <= _PARALLEL * dd * ee:
        # The shares at which this segment is beside the start and beside the end of the other segment.
        at_start, at_end = _clipped(-dp / dd), _clipped((de - dp) / dd)
        return 0.5 * (at_start + at_end)
    t = _clipped((de * ep - ee * dp) / square)
    s = _clipped((ep + t * de) / ee)
    return _clipped((s * de - dp) / dd)


@inline_kernel
def share_of(kind: int, p: Vector3, d: Vector3, rotation: Array, half: Array) -> float:
    """Returns the share of the segment p … p + d at which it is nearest to a shape; 0 for a segment of length
    0. p and d are relative to the shape's middle, in the axes of the shape's carrier."""
    if d[0] == 0.0 and d[1] == 0.0 and d[2] == 0.0:
        return 0.0
    if kind == FLOOR:
        return 0.0 if d[2] > 0.0 else 1.0 if d[2] < 0.0 else 0.5
    if kind == BOX:
        return _along_box(p, d, rotation, half)
    if kind == CAPSULE:
        return _along_segment(p, d, half)
    return _clipped(-(d[0] * p[0] + d[1] * p[1] + d[2] * p[2]) / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]))


@inline_kernel
def find_near(
    placed: Array,
    z: Array,
    is_revolute: Indices,
    column: Indices,
    factor: Array,
    carries: Array,
    joint: Indices,
    centre: Array,
    span: Array,
    radius: Array,
    kind: Indices,
    carrier: Indices,
    rotation: Array,
    middle: Array,
    half: Array,
    thickness: Array,
    meets: Indices,
    within: float,
    centres: Array,
    spans: Array,
    knot: Indices,
    sphere: Indices,
    shape: Indices,
    share: Array,
    distance: Array,
    normal: Array,
    slopes: Array,
) -> int:
    """Finds the pairs of a capsule and a shape that are nearer than `within`, m; returns their number.

    A capsule's distance is that of the nearest point of its segment minus its radius. The gradient is the
    unit vector from the shape to that point, multiplied by the Jacobian of the relative motion.

    Args:
        placed, z: (K, J, …) joints, see `forward_kinematics`.
        is_revolute, column, factor, carries: see `Geometry`.
        joint, centre, span, radius, kind, carrier, rotation, middle, half, thickness, meets: see
            `Surroundings`.
        centres, spans: scratch, (K, S, 3).
        knot, sphere, shape: indices of each pair, with space for all pairs; the result.
        share, distance, normal: share of the capsule's segment, m, and the unit vector, world axes; the
            result.
        slopes: the gradients, with space for all pairs or for none; the result.
    """
    K, S, B = len(placed), len(radius), len(kind)
    placed, z, centres, normal = borrowed(placed), borrowed(z), borrowed(centres), borrowed(normal)
    rotation, middle, half, slopes = borrowed(rotation), borrowed(middle), borrowed(half), borrowed(slopes)
    span, spans = borrowed(span), borrowed(spans)
    for k in range(K):
        points(placed[k], joint, centre, centres[k])
        for s in range(S):
            on = placed[k, joint[s]]
            for a in range(3):
                spans[k, s, a] = (
                    on[3 * a] * span[s, 0] + on[3 * a + 1] * span[s, 1] + on[3 * a + 2] * span[s, 2]
                )
    count = 0
    for o in range(B):
        c = carrier[o]
        for k in range(K):
            R = placed[k, c]
            for s in range(S):
                if not meets[o, s]:
                    continue
                # The vector from the shape's middle to the capsule's start, in the axes of the shape's
                # carrier.
                u, C, along = normal[count], centres[k, s], spans[k, s]
                x, y, h = C[0] - R[9], C[1] - R[10], C[2] - R[11]
                x, y, h = (
                    R[0] * x + R[3] * y + R[6] * h - middle[o, 0],
                    R[1] * x + R[4] * y + R[7] * h - middle[o, 1],
                    R[2] * x + R[5] * y + R[8] * h - middle[o, 2],
                )
                d = (
                    R[0] * along[0] + R[3] * along[1] + R[6] * along[2],
                    R[1] * along[0] + R[4] * along[1] + R[7] * along[2],
                    R[2] * along[0] + R[5] * along[1] + R[8] * along[2],
                )
                t = share_of(kind[o], (x, y, h), d, rotation[o], half[o])
                x, y, h = x + t * d[0], y + t * d[1], h + t * d[2]
                if kind[o] == FLOOR:
                    gap = h
                    u[0], u[1], u[2] = 0.0, 0.0, 1.0
                elif kind[o] == BOX:
                    gap = from_box(x, y, h, rotation[o], half[o], u)
                elif kind[o] == BALL:
                    gap = from_ball(x, y, h, half[o, 0], u)
                else:
                    gap = from_segment(x, y, h, half[o], thickness[o], u)
                gap -= radius[s]
                # A distance that is NaN does not count as near.
                if not gap <= within:
                    continue
                x, y, h = u[0], u[1], u[2]
                for a in range(3):
                    u[a] = R[3 * a] * x + R[3 * a + 1] * y + R[3 * a + 2] * h
                knot[count], sphere[count], shape[count], distance[count] = k, s, o, gap
                share[count] = t
                count += 1
    for r in range(min(count, len(slopes))):
        k, s, c = knot[r], sphere[r], carrier[shape[r]]
        u, C, along, t = normal[r], centres[k, s], spans[k, s], share[r]
        for j in range(slopes.shape[1]):
            slopes[r, j] = 0.0
        for j in range(1, column.size):
            # A joint that moves both the capsule and the shape does not change their distance.
            sign = carries[joint[s], j] - carries[c, j]
            if sign == 0.0:
                continue
            w, on = z[k, j], placed[k, j]
            if is_revolute[j]:
                x, y, h = (
                    C[0] + t * along[0] - on[9],
                    C[1] + t * along[1] - on[10],
                    C[2] + t * along[2] - on[11],
                )
                rate = (
                    u[0] * (w[1] * h - w[2] * y) + u[1] * (w[2] * x - w[0] * h) + u[2] * (w[0] * y - w[1] * x)
                )
            else:
                rate = u[0] * w[0] + u[1] * w[1] + u[2] * w[2]
            add(slopes[r], column[j], factor[j] * sign * rate)
    return count


near = kernel(
    *(MATRICES, MATRICES, INDICES, INDICES, VECTOR, MATRIX, INDICES, MATRIX, MATRIX, VECTOR),
    *(INDICES, INDICES, MATRICES, MATRIX, MATRIX, VECTOR, TABLE, NUMBER),
    *(MATRICES, MATRICES, INDICES, INDICES, INDICES, VECTOR, VECTOR, MATRIX, MATRIX),
)(plain(find_near))
"""`find_near` for callers in Python."""
