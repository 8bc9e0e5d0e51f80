"""Entry: from the measured state and the references to the data of all QPs."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import INDICES, VECTOR, kernel
from himpc.compilation.views import matrices, matrix, vector
from himpc.tick.kernel.arena import AT, NOW, PERIOD, REACTION, T_S, WHOLE_AT, Whole
from himpc.tick.kernel.bounds import bounds
from himpc.tick.kernel.kinematics import (
    DAMPING,
    GIVEN,
    JOINTS,
    ORIENTATION,
    about_one_axis,
    forward_kinematics,
    jacobian,
    leans,
    points,
    rotation_of_frame,
    turned_away,
)
from himpc.tick.kernel.linear import dot
from himpc.tick.kernel.references import curves
from himpc.tick.kernel.residual import free_motion


@kernel(VECTOR, INDICES, INDICES, INDICES)
def linearize(data: Any, where: Whole, whole: Whole, whole_where: Whole) -> bool:
    """The measured state and the references as the data of all QPs: kinematics along the last prediction
    (30), residuals, free motion (15) and bounds (32d)–(32f). False if they are not finite.

    The knots q*_{k+j|k−1} are the last prediction re-rooted at the measured q.
    """
    s = vector(whole, whole_where[WHOLE_AT.sizes], 11)
    n, N, M, m, T, F, b, G = s[0], s[1], s[2], s[3], s[5], s[6], s[7], s[10]
    scalars = vector(data, where[AT.scalars], 4)
    period, T_s, reaction = scalars[PERIOD], scalars[T_S], scalars[REACTION]
    q, v = vector(data, where[AT.q], n), vector(data, where[AT.v], n)
    q_was, v_was = vector(data, where[AT.q_was], n), vector(data, where[AT.v_was], n)
    tau_0, M_bar = vector(data, where[AT.tau_0], n), vector(data, where[AT.M_bar], n)
    parent, is_revolute = (
        vector(whole, whole_where[WHOLE_AT.parent], n + 1),
        vector(whole, whole_where[WHOLE_AT.is_revolute], n + 1),
    )
    rotation, translation = (
        matrices(data, where[AT.rotation], n + 1, 3, 3),
        matrix(data, where[AT.translation], n + 1, 3),
    )
    axis = matrix(data, where[AT.axis], n + 1, 3)
    frame_joint = vector(whole, whole_where[WHOLE_AT.frame_joint], F)
    frame_rotation, frame_translation = (
        matrices(data, where[AT.frame_rotation], F, 3, 3),
        matrix(data, where[AT.frame_translation], F, 3),
    )
    task, part = matrix(whole, whole_where[WHOLE_AT.task], T, 4), vector(whole, whole_where[WHOLE_AT.part], M)
    placed, z = matrix(data, where[AT.placed], n + 1, 12), matrix(data, where[AT.axis_now], n + 1, 3)
    point, path = matrix(data, where[AT.point], F, 3), matrix(data, where[AT.path], N + 1, n)
    B = matrices(data, where[AT.B], N, M, n)
    x_dot, x_dot_was = vector(data, where[AT.x_dot], M), vector(data, where[AT.x_dot_was], M)
    value, error, x_d = (
        vector(data, where[AT.value], M),
        vector(data, where[AT.error], M),
        vector(data, where[AT.x_d], M),
    )
    R_now, R_d = matrices(data, where[AT.R_now], T, 3, 3), matrices(data, where[AT.R_d], T, 3, 3)
    at, given = vector(data, where[AT.z], n), matrices(data, where[AT.given], N + 1, G, n)

    turned = vector(data, where[AT.slope], 3)

    known = vector(whole, whole_where[WHOLE_AT.known], 2)
    if not known[0]:
        forward_kinematics(q_was, parent, is_revolute, rotation, translation, axis, placed, z)
        points(placed, frame_joint, frame_translation, point)
        jacobian(task, part, parent, is_revolute, placed, z, frame_joint, point, given[N], B[0])
        about_one_axis(
            task, part, parent, is_revolute, placed, z, frame_joint, frame_rotation, R_d, R_now, turned, B[0]
        )
        for i in range(M):
            x_dot_was[i] = dot(B[0, i], v_was, n)
        known[0] = 1
    for j in range(N - 1, -1, -1):  # the measured state last: places and axes are then its own
        for a in range(n):
            at[a] = path[1 + j, a] + (q[a] - path[1, a]) if j else q[a]
        forward_kinematics(at, parent, is_revolute, rotation, translation, axis, placed, z)
        points(placed, frame_joint, frame_translation, point)
        jacobian(task, part, parent, is_revolute, placed, z, frame_joint, point, given[j], B[j])
        about_one_axis(
            task, part, parent, is_revolute, placed, z, frame_joint, frame_rotation, R_d, R_now, turned, B[j]
        )
    motion = matrices(data, where[AT.motion], 3, N + 1, M)
    displacement, velocity_d, acceleration_d = motion[0], motion[1], motion[2]
    curves(
        scalars[NOW],
        T_s,
        task,
        vector(whole, whole_where[WHOLE_AT.law], T),
        matrix(data, where[AT.pace], T, 2),
        matrix(data, where[AT.curve], M, 4),
        x_d,
        displacement,
        velocity_d,
        acceleration_d,
    )
    for t in range(T):
        kind, frame, first, size = task[t, 0], task[t, 1], task[t, 2], task[t, 3]
        if kind == ORIENTATION:
            rotation_of_frame(placed[frame_joint[frame]], frame_rotation[frame], R_now[t])
            if size == 2:
                leans(R_now[t], R_d[t], 3 - part[first] - part[first + 1], turned)
            else:
                turned_away(R_now[t], R_d[t], turned)
        for i in range(first, first + size):
            x_dot[i] = dot(B[0, i], v, n)
            if kind == GIVEN:
                continue
            if kind == ORIENTATION:
                error[i] = turned[part[i]]
                continue
            value[i] = q[part[i]] if kind >= JOINTS else point[frame, part[i]]
            error[i] = 0.0 if kind == DAMPING else value[i] - x_d[i]
    for j in range(N):
        for i in range(m):
            for a in range(n):
                B[j, i, a] /= M_bar[a]
    bounds(
        q,
        v,
        v_was,
        tau_0,
        M_bar,
        matrix(data, where[AT.limits], 8, n),
        vector(data, where[AT.approach], N),
        s[9],
        reaction,
        period,
        T_s,
        matrix(data, where[AT.lower], b, n),
        matrix(data, where[AT.upper], b, n),
        matrix(data, where[AT.stopping], 2, n),
    )
    total = free_motion(
        error,
        x_dot,
        x_dot_was,
        period,
        vector(data, where[AT.K_p], M),
        vector(data, where[AT.K_v], M),
        matrix(data, where[AT.on_velocity], N, M),
        matrix(data, where[AT.on_acceleration], N, M),
        displacement,
        velocity_d,
        acceleration_d,
        m,
        matrix(data, where[AT.free], N, M),
    )
    return math.isfinite(total)
