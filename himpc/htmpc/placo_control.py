"""placo, a library for whole-body inverse kinematics, as a rival of HTMPC: one QP per period, in which one
level is strict and all others are weighed against each other."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from functools import cache
from threading import Lock
from time import perf_counter_ns
from typing import TYPE_CHECKING, final

import numpy as np

from himpc.htmpc.differential import Box, DifferentialController, Solved, wanted
from himpc.htmpc.plan import ActiveMotionRows, LevelEvidence
from himpc.htmpc.settings import HTMPCSettings
from himpc.kinematics.configuration import Configuration, joint_indices
from himpc.references import Preview
from himpc.rotation import exp3
from himpc.stack import Level, Stack
from himpc.tasks import Damping, FrameOrientation, FramePosition, Joints, Posture, Task
from robots import InputError, Robot
from robots.arrays import Array

if TYPE_CHECKING:
    import placo

Aim = Callable[[Configuration, Array], None]
"""Gives placo's task its target: the present value of our task, moved by the given coordinates, (m,)."""

_FASTEST = 1e4
"""Stands for an infinite bound on a velocity, rad/s or m/s."""
_NO_ROWS = ActiveMotionRows(
    np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0), ()
)
_ONE_AT_A_TIME = Lock()
"""All controllers of a robot in this process share one wrapper, which contains the state."""


@final
class Placo(DifferentialController):
    """With ẋ_l = ṙ + gain · (r − x) at each level l, placo minimises Σ_l Q_l T²‖J_l q̇ − ẋ_l‖² + ρ T²‖q̇‖² over
    the box of velocities that `reachable` returns, by its own QP solver. T is the control period, and the box
    gives the limits of position, velocity and acceleration. `first_level` treats the first enabled level in
    one of three ways:

    - "hard": J_1 q̇ = ẋ_1. If no velocity satisfies this, placo raises an exception, and the robot brakes;
    - "scaled": J_1 q̇ = s ẋ_1, where (1 − s)² is added to the sum and 0 ≤ s ≤ 1;
    - "soft": as the other levels.

    It does not look ahead, and ignores obstacles. It gives no multipliers: `kkt_residual` is the amount by
    which placo's velocity is outside the box.
    """

    def _fit(self, levels: Stack, settings: HTMPCSettings) -> None:
        if settings.solver != "daqp":
            raise InputError(
                f"solver={settings.solver} changes nothing here: placo has its own QP solver; set solver=daqp"
            )
        import placo

        wrapper = _wrapper(self.robot.urdf_text)
        solver = placo.KinematicsSolver(wrapper)
        aims: dict[str, Aim] = {}
        for index, level in enumerate(levels):
            priority, weight = settings.first_level if index == 0 else "soft", _weight(level)
            for task in level.tasks:
                aims[task.name] = _added(self.robot, solver, task, priority, weight)
        solver.add_regularization_task(settings.rho)
        solver.mask_fbase(True)  # placo gives every robot a floating base
        solver.enable_velocity_limits(False)  # the box contains these limits, as they are set now
        solver.enable_joint_limits(False)
        # To placo, every joint moves by itself: equations tie those that follow others to their leaders.
        told = _followers(self.robot.urdf_text)
        place = wrapper.get_joint_offset
        self._own = np.array([place(name) for name in self.robot.joint_names])
        self._followers = np.array([place(name) for name, *_ in told], np.intp)
        self._leaders = np.array([place(leader) for _, leader, *_ in told], np.intp)
        self._factors = np.array([factor for *_, factor, _ in told])
        self._offsets = np.array([offset for *_, offset in told])
        every = np.eye(wrapper.state.q.size)
        ties = every[self._followers] - self._factors[:, None] * every[self._leaders]
        rows = np.vstack([every[self._own], ties])
        self._rows = solver.add_joint_space_half_spaces_constraint(
            np.vstack([rows, -rows]), np.zeros(len(rows) * 2)
        )
        self._rows.configure("box", "hard", 1.0)
        self._solver, self._aims = solver, aims

    def _solve(self, here: Configuration, previews: Mapping[str, Preview], box: Box) -> Solved:
        T, notice, command, outside = self._settings.period, None, box.rest, 0.0
        goals: list[Array] = []
        for index, level in enumerate(self._levels):
            velocities = [wanted(task, here, previews, self._gain(index)) for task in level.tasks]
            for task, velocity in zip(level.tasks, velocities, strict=True):
                self._aims[task.name](here, T * velocity)
            goals.append(np.concatenate(velocities))
        begun = perf_counter_ns()
        steps = T * np.clip(box, -_FASTEST, _FASTEST)
        self._rows.b = np.concatenate([here.q + steps[1], self._offsets, -here.q - steps[0], -self._offsets])
        wrapper = _wrapper(self.robot.urdf_text)
        try:
            with _ONE_AT_A_TIME:
                posture = wrapper.state.q
                posture[self._own] = here.q
                posture[self._followers] = self._factors * posture[self._leaders] + self._offsets
                wrapper.state.q = posture
                wrapper.update_kinematics()
                free = self._solver.solve(False)[self._own - 1] / T
            command = np.clip(free, box.lower, box.upper)
            outside = float(np.abs(free - command).max())
        except RuntimeError as fault:
            notice = _notice(str(fault), self._settings.first_level)
        time_us = (perf_counter_ns() - begun) / 1e3
        levels = []
        for level, goal in zip(self._levels, goals, strict=True):
            gap = np.vstack([task.jacobian(here)[0] for task in level.tasks]) @ command - goal
            first = not levels  # the first level has the figures of the one QP
            levels.append(
                LevelEvidence(
                    name=level.name,
                    status=notice or "solved",
                    fallback="solve" if notice is None else "keep",
                    kkt_residual=outside if first else np.nan,
                    best=gap[None],
                    final=gap[None],
                    cost=0.5 * float(gap @ gap),
                    steps=(float(notice is None),),
                    iterations=int(first),
                    unsolved=int(first and notice is not None),
                    time_us=time_us if first else 0.0,
                    active=_NO_ROWS,
                )
            )
        return Solved(command, tuple(levels), notice)


@cache
def _wrapper(urdf_text: str) -> placo.RobotWrapper:
    """Returns placo's robot. placo never frees a robot (0.2 MB each): there is one for each description,
    which lasts as long as the process."""
    import placo

    tree = ET.fromstring(urdf_text)
    for link in tree.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)  # placo would look for the meshes
    return placo.RobotWrapper("", placo.Flags.ignore_collisions, ET.tostring(tree, encoding="unicode"))


def _followers(urdf_text: str) -> list[tuple[str, str, float, float]]:
    """Returns the joints that follow others: name, leader, factor and offset, rad or m."""
    joints = [
        (joint.get("name", ""), joint.find("mimic")) for joint in ET.fromstring(urdf_text).iter("joint")
    ]
    return [
        (name, told.get("joint", ""), float(told.get("multiplier", "1")), float(told.get("offset", "0")))
        for name, told in joints
        if told is not None
    ]


def _added(robot: Robot, solver: placo.KinematicsSolver, task: Task, priority: str, weight: float) -> Aim:
    """Adds a task to placo's problem, and returns the function that gives it a target."""
    match task:
        case FramePosition():
            theirs = solver.add_position_task(task.frame or robot.tip, np.zeros(3))
            theirs.mask.set_axises(task.axes, "task")

            def aim(here: Configuration, step: Array) -> None:
                target = here.placement(task.frame).translation.copy()
                target[task.components] += step
                theirs.target_world = target
        case FrameOrientation() if len(task.axes) > 1:
            theirs = solver.add_orientation_task(task.frame or robot.tip, np.eye(3))
            theirs.mask.set_axises(task.axes, "task")

            def aim(here: Configuration, step: Array) -> None:
                turn = exp3(task.spread(step[None])[0])
                theirs.R_world_frame = turn @ here.placement(task.frame).rotation
        case Joints() | Posture() | Damping():
            theirs = solver.add_joints_task()
            indices = joint_indices(robot, task.joints)
            names = [robot.joint_names[index] for index in indices]

            def aim(here: Configuration, step: Array) -> None:
                theirs.set_joints(dict(zip(names, (here.q[indices] + step).tolist(), strict=True)))

            theirs.set_joints(dict.fromkeys(names, 0.0))
        case _:
            raise InputError(
                f"placo has no task like '{task.name}' here: it takes positions, orientations on two or "
                "three axes, and joints; remove the task, or choose another controller"
            )
    theirs.configure(task.name, priority, weight)
    return aim


def _weight(level: Level) -> float:
    if np.ndim(level.Q):
        raise InputError(f"Q of level '{level.name}' is a list: placo weighs a level by one number, e.g. 10")
    return float(np.asarray(level.Q))


def _notice(sentence: str, first_level: str) -> str:
    other = " first_level=scaled slows level 1 down instead." if first_level == "hard" else ""
    return f"placo found no velocity, and the robot brakes: {sentence.removeprefix('QPError: ')}.{other}"
