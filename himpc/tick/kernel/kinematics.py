"""Kinematics of a tree of revolute and prismatic joints: placements of frames, rows of the Jacobian (3)."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.linear import copy

POSITION, ORIENTATION, JOINTS, DAMPING, PYTHON = range(5)
"""Kinds of tasks. The rows, the value and the error of a PYTHON task are input."""


@inline_kernel
def forward_kinematics(
    q: Array,
    parent: IntArray,
    is_revolute: IntArray,
    column: IntArray,
    factor: Array,
    rotation: Array,
    translation: Array,
    axis: Array,
    placed: Array,
    z: Array,
) -> None:
    """Computes the placements of all J − 1 joints at q in world axes: `placed` (J, 12) contains the rotation
    row by row, then the origin; index 0 is the world. z (J, 3) contains the joints' axes in the world.

    Args:
        q: (n,) rad or m.
        parent: index of each joint's parent, which is always smaller.
        is_revolute: whether the joint is revolute, not prismatic.
        column, factor: the joint moves by factor · q[column], see `Geometry`.
        rotation, translation: from the parent to the joint at q = 0.
        axis: axis of the joint, in the joint's own axes.
        placed, z: the result.
    """
    for a in range(12):
        placed[0, a] = 1.0 if a % 4 == 0 and a < 9 else 0.0
    for j in range(1, parent.size):
        before, here = placed[parent[j]], placed[j]
        x, y, w, angle = axis[j, 0], axis[j, 1], axis[j, 2], factor[j] * q[column[j]]
        cos, sin = (math.cos(angle), math.sin(angle)) if is_revolute[j] else (1.0, 0.0)
        gone = 0.0 if is_revolute[j] else angle
        for a in range(3):
            left, middle, right = before[3 * a], before[3 * a + 1], before[3 * a + 2]
            f = left * rotation[j, 0, 0] + middle * rotation[j, 1, 0] + right * rotation[j, 2, 0]
            g = left * rotation[j, 0, 1] + middle * rotation[j, 1, 1] + right * rotation[j, 2, 1]
            h = left * rotation[j, 0, 2] + middle * rotation[j, 1, 2] + right * rotation[j, 2, 2]
            z[j, a] = f * x + g * y + h * w
            along = (1.0 - cos) * z[j, a]
            here[3 * a] = cos * f + along * x + sin * (g * w - h * y)
            here[3 * a + 1] = cos * g + along * y + sin * (h * x - f * w)
            here[3 * a + 2] = cos * h + along * w + sin * (f * y - g * x)
            point = left * translation[j, 0] + middle * translation[j, 1] + right * translation[j, 2]
            here[9 + a] = before[9 + a] + point + gone * z[j, a]


@inline_kernel
def points(placed: Array, frame_joint: IntArray, frame_translation: Array, point: Array) -> None:
    """Computes the origins of the frames in the world, (F, 3) m."""
    for f in range(frame_joint.size):
        on, r = placed[frame_joint[f]], frame_translation[f]
        for a in range(3):
            point[f, a] = on[9 + a] + on[3 * a] * r[0] + on[3 * a + 1] * r[1] + on[3 * a + 2] * r[2]


@inline_kernel
def add(row: Array, column: int, x: Any) -> None:
    """Adds x to an element, which keeps the sign of a zero x."""
    row[column] = x if row[column] == 0.0 else row[column] + x


@inline_kernel
def jacobian(
    task: IntArray,
    part: IntArray,
    parent: IntArray,
    is_revolute: IntArray,
    column: IntArray,
    factor: Array,
    placed: Array,
    z: Array,
    frame_joint: IntArray,
    point: Array,
    python_jacobian: Array,
    J: Array,
) -> None:
    """Computes J_i of (3) of all tasks, one below another, (M, n), in world axes at the frames' origins. A
    joint that follows another one adds to the column of its leader.

    Args:
        task: (T, 4) kind, frame, first row and number of rows of each task.
        part: (M,) for each row, the index of its axis, of its joint, or of its row in `python_jacobian`.
        parent, is_revolute, column, factor, placed, z: as in `forward_kinematics`.
        frame_joint, point: the joint that carries each frame, and its origin.
        python_jacobian: rows of the tasks that Python computes, (G, n).
        J: the result.
    """
    J[:] = 0.0
    for t in range(len(task)):
        kind, frame, first, size = task[t, 0], task[t, 1], task[t, 2], task[t, 3]
        for i in range(first, first + size):
            if kind == PYTHON:
                copy(python_jacobian[part[i]], J[i], J.shape[1])
                continue
            if kind >= JOINTS:
                J[i, part[i]] = 1.0
                continue
            c = part[i]
            a, b = (c + 1) % 3, (c + 2) % 3
            j = frame_joint[frame]
            while j > 0:
                if kind == ORIENTATION:
                    rate = z[j, c] if is_revolute[j] else 0.0
                elif is_revolute[j]:
                    x, y = point[frame, a] - placed[j, 9 + a], point[frame, b] - placed[j, 9 + b]
                    rate = z[j, a] * y - z[j, b] * x
                else:
                    rate = z[j, c]
                add(J[i], column[j], factor[j] * rate)
                j = parent[j]


@inline_kernel
def rotation_of_frame(on: Array, rotation: Array, R: Array) -> None:
    """Computes R of a frame in the world, (3, 3); `on` is the placement of the joint that carries the
    frame."""
    for a in range(3):
        for b in range(3):
            R[a, b] = (
                on[3 * a] * rotation[0, b] + on[3 * a + 1] * rotation[1, b] + on[3 * a + 2] * rotation[2, b]
            )


@inline_kernel
def about_one_axis(
    task: IntArray,
    part: IntArray,
    parent: IntArray,
    is_revolute: IntArray,
    column: IntArray,
    factor: Array,
    placed: Array,
    z: Array,
    frame_joint: IntArray,
    frame_rotation: Array,
    R_d: Array,
    R_now: Array,
    w: Array,
    J: Array,
) -> None:
    """Computes the row of every orientation task on a single axis a: aᵀ J_l⁻¹(log₃(R R_dᵀ)) times the
    Jacobian of ω, see `OrientationTask`. Before the call, the row is aᵀ times the Jacobian of ω, written by
    `jacobian`.

    Args:
        task, part, parent, is_revolute, column, factor, placed, z, frame_joint, J: as in `jacobian`.
        frame_rotation: rotation of each frame. R_d: reference of each task.
        R_now, w: scratch for a rotation per task, and for three numbers.
    """
    for t in range(len(task)):
        if task[t, 0] != ORIENTATION or task[t, 3] != 1:
            continue
        i = task[t, 2]
        a, j = part[i], frame_joint[task[t, 1]]
        rotation_of_frame(placed[j], frame_rotation[task[t, 1]], R_now[t])
        rotation_error(R_now[t], R_d[t], w)
        square = dot3(w, w)
        angle = math.sqrt(square)
        even = 0.5 * angle / math.tan(0.5 * angle) if angle > 1e-4 else 1.0 - square / 12.0
        bent = (1.0 - even) / square if angle > 1e-4 else 1.0 / 12.0
        b, c = (a + 1) % 3, (a + 2) % 3
        on_a, on_b, on_c = (
            even + bent * w[a] * w[a],
            bent * w[a] * w[b] + 0.5 * w[c],
            bent * w[a] * w[c] - 0.5 * w[b],
        )
        while j > 0:
            J[i, column[j]] = 0.0
            j = parent[j]
        j = frame_joint[task[t, 1]]
        while j > 0:
            if is_revolute[j]:
                add(J[i], column[j], factor[j] * (on_a * z[j, a] + on_b * z[j, b] + on_c * z[j, c]))
            j = parent[j]


@inline_kernel
def tilt_error(R: Array, D: Array, f: int, out: Array) -> None:
    """Computes φ (f × p)/‖f × p‖ of p = R Dᵀ f, (3,) rad: the residual of an orientation task with axis f
    free."""
    g, h = (f + 1) % 3, (f + 2) % 3
    ahead, first, second = dot3(R[f], D[f]), dot3(R[g], D[f]), dot3(R[h], D[f])
    aside = math.sqrt(first * first + second * second)
    out[0], out[1], out[2] = 0.0, 0.0, 0.0
    if aside > 1e-12:
        share = math.atan2(aside, ahead) / aside
        out[g], out[h] = -share * second, share * first
    elif ahead > 0.0:
        out[g], out[h] = -second, first
    else:
        out[g] = math.pi


@inline_kernel
def rotation_error(R: Array, D: Array, out: Array) -> None:
    """Computes log₃(R Dᵀ), (3,) rad: the residual of an orientation task.

    It uses a quaternion whose largest component is computed by a square root. The result is accurate at every
    angle up to π.
    """
    E = (
        (dot3(R[0], D[0]), dot3(R[0], D[1]), dot3(R[0], D[2])),
        (dot3(R[1], D[0]), dot3(R[1], D[1]), dot3(R[1], D[2])),
        (dot3(R[2], D[0]), dot3(R[2], D[1]), dot3(R[2], D[2])),
    )
    xx, yy, zz = E[0][0], E[1][1], E[2][2]
    w, x, y, z = 1.0 + xx + yy + zz, E[2][1] - E[1][2], E[0][2] - E[2][0], E[1][0] - E[0][1]
    if w < 1.0:
        # Above 90° the vector part is large; a division by the sine of the angle would be inaccurate.
        if xx >= yy and xx >= zz:
            w, x, y, z = x, 1.0 + xx - yy - zz, E[0][1] + E[1][0], E[0][2] + E[2][0]
        elif yy >= zz:
            w, x, y, z = y, E[0][1] + E[1][0], 1.0 + yy - xx - zz, E[1][2] + E[2][1]
        else:
            w, x, y, z = z, E[0][2] + E[2][0], E[1][2] + E[2][1], 1.0 + zz - xx - yy
        if w < 0.0:
            w, x, y, z = -w, -x, -y, -z
    length = math.sqrt(x * x + y * y + z * z)
    share = 2.0 * math.atan2(length, w) / length if length > 1e-12 * w else 2.0 / w
    out[0], out[1], out[2] = share * x, share * y, share * z


@inline_kernel
def dot3(a: Array, b: Array) -> float:
    """Returns aᵀb of vectors of three numbers."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
