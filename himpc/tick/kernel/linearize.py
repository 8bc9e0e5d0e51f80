"""Computes the data of all QPs from the measured state and the references."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import always_inline_kernel, inline_kernel
from himpc.tick.kernel.arrays import NOW, PERIOD, PULL, REACTION, T_S, Array, IntArray, TickArrays, arrays_of
from himpc.tick.kernel.bounds import bounds
from himpc.tick.kernel.kinematics import (
    DAMPING,
    JOINTS,
    ORIENTATION,
    PYTHON,
    about_one_axis,
    forward_kinematics,
    jacobian,
    points,
    rotation_error,
    rotation_of_frame,
    tilt_error,
)
from himpc.tick.kernel.linear import dot
from himpc.tick.kernel.pull import bounded_pull
from himpc.tick.kernel.references import curves
from himpc.tick.kernel.residual import free_motion

_MODE = 9
"""Index in `sizes` of the kind of position limits, see `bounds`."""


@always_inline_kernel
def jacobian_at(t: TickArrays, q: Array, python_jacobian: Array, J: Array) -> None:
    """Writes J_i of (3) of all tasks at q to J (M, n); `python_jacobian` (G, n) contains the rows that Python
    computes."""
    forward_kinematics(
        *(q, t.parent, t.is_revolute, t.column, t.factor, t.rotation, t.translation, t.axis),
        *(t.placed, t.axis_now),
    )
    points(t.placed, t.frame_joint, t.frame_translation, t.point)
    jacobian(
        *(t.task, t.part, t.parent, t.is_revolute, t.column, t.factor, t.placed, t.axis_now),
        *(t.frame_joint, t.point, python_jacobian, J),
    )
    about_one_axis(
        *(t.task, t.part, t.parent, t.is_revolute, t.column, t.factor, t.placed, t.axis_now),
        *(t.frame_joint, t.frame_rotation, t.R_d, t.R_now, t.slope, J),
    )


@always_inline_kernel
def errors(t: TickArrays) -> None:
    """Computes x, x̃ and ẋ of all tasks in the measured state."""
    for task in range(len(t.task)):
        kind, frame, first, size = t.task[task, 0], t.task[task, 1], t.task[task, 2], t.task[task, 3]
        R, R_d, turned = t.R_now[task], t.R_d[task], t.slope
        if kind == ORIENTATION:
            rotation_of_frame(t.placed[t.frame_joint[frame]], t.frame_rotation[frame], R)
            if size == 2:
                tilt_error(R, R_d, 3 - t.part[first] - t.part[first + 1], turned)
            else:
                rotation_error(R, R_d, turned)
        for i in range(first, first + size):
            t.x_dot[i] = dot(t.B[0, i], t.v, t.v.size)
            if kind == PYTHON:
                continue
            if kind == ORIENTATION:
                t.error[i] = turned[t.part[i]]
                continue
            t.value[i] = t.q[t.part[i]] if kind >= JOINTS else t.point[frame, t.part[i]]
            t.error[i] = 0.0 if kind == DAMPING else t.value[i] - t.x_d[i]


@inline_kernel
def linearize(data: Any, where: IntArray, whole: IntArray, whole_where: IntArray) -> bool:
    """Computes the data of all QPs from the measured state and the references: kinematics along the last
    prediction (30), residuals, free motion (15) and bounds (32d)–(32f). Returns False if these data are not
    finite. The knots q*_{k+j|k−1} are the last prediction, shifted to begin at the measured q.
    """
    t = arrays_of(data, where, whole, whole_where)
    M, m = t.sizes[2], t.sizes[3]
    N, n = t.fixed.shape
    period, T_s, reaction = t.scalars[PERIOD], t.scalars[T_S], t.scalars[REACTION]
    if not t.known[0]:
        jacobian_at(t, t.q_was, t.python_jacobian[N], t.B[0])
        for i in range(M):
            t.x_dot_was[i] = dot(t.B[0, i], t.v_was, n)
        t.known[0] = 1
    # The measured state comes last: placements and axes are then those of this state.
    for j in range(N - 1, -1, -1):
        for a in range(n):
            t.z[a] = t.path[1 + j, a] + (t.q[a] - t.path[1, a]) if j else t.q[a]
        jacobian_at(t, t.z[:n], t.python_jacobian[j], t.B[j])
    displacement, velocity_d, acceleration_d = t.motion[0], t.motion[1], t.motion[2]
    curves(
        *(t.scalars[NOW], T_s, t.task, t.law, t.pace, t.curve),
        *(t.x_d, displacement, velocity_d, acceleration_d),
    )
    errors(t)
    for j in range(N):
        for i in range(m):
            for a in range(n):
                t.B[j, i, a] /= t.M_bar[a]
    bounds(
        *(t.q, t.v, t.v_was, t.tau_0, t.M_bar, t.limits, t.approach, t.sizes[_MODE], reaction, period, T_s),
        *(t.lower, t.upper, t.stopping),
    )
    total = free_motion(
        *(t.error, t.x_dot, t.x_dot_was, period, t.K_p, t.K_v, t.on_velocity, t.on_acceleration),
        *(displacement, velocity_d, acceleration_d, m, t.free),
    )
    if t.scalars[PULL] < math.inf:
        bounded_pull(t.task, t.error, t.scalars[PULL], t.K_p, m, t.free)
    return math.isfinite(total)
