"""Writes the robot and the settings into an arena: geometry, tasks, gains, bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from himpc.formulation.forms import StackForm
from himpc.formulation.settings import Settings
from himpc.kinematics.configuration import joint_indices
from himpc.kinematics.geometry import geometry
from himpc.limits import LimitsInForce
from himpc.limits.constraints import bit_of, imposed
from himpc.limits.rows import profiles
from himpc.references import Preview, Reference
from himpc.references.curves import curve_of
from himpc.tasks import Damping, FrameOrientation, FramePosition, Joints, Posture, Task
from himpc.tasks.axes import AXES, FrameTask
from himpc.tasks.joints import OnJoints
from himpc.tick.kernel import kinematics
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.bounds import OFF, PAPER, VIABILITY
from himpc.tick.kernel.references import EASED, SAMPLED, UNIFORM
from himpc.tick.tables import python_constraints, sizes
from robots import Robot

Span = tuple[int, Task, slice]
"""The index of a task, the task, and its rows."""

_BUILT_IN = (FramePosition, FrameOrientation, Joints, Posture, Damping)


def is_built_in(task: Task) -> bool:
    """Returns whether the kernel computes the task; otherwise its rows are computed in Python."""
    return type(task) in _BUILT_IN


def arena_for(
    robot: Robot, settings: Settings, form: StackForm, off: Sequence[Task], levels: int
) -> tuple[Arena, list[Span]]:
    """Returns an arena for a robot and its settings, and the rows of each task; `write_numbers` fills it.

    Args:
        robot, settings: as for a controller.
        form: the levels that are solved.
        off: tasks that are measured only.
        levels: number of levels.
    """
    tasks = (*form.tasks, *off)
    counts = [*form.sizes, *(len(task.coordinates(robot)) for task in off)]
    constraints = imposed(settings.limits)
    N, solved = settings.horizon, sum(form.sizes)
    bounds, directed = len(constraints) * N, len(python_constraints(constraints))
    arena, spans = write_tasks(robot, tasks, counts, N, solved, levels, bounds, directed)
    arena.f["L"][:], arena.f["nothing"][:] = profiles(N, constraints), np.nan
    arena.i["bit"][:] = np.repeat([bit_of(constraint) for constraint in constraints], N)
    arena.f["scalars"][:2] = settings.T_s
    arena.i["sizes"][9] = {"viability": VIABILITY, "paper": PAPER, "off": OFF}[settings.limits.position]
    return arena, spans


def write_tasks(
    robot: Robot,
    tasks: Sequence[Task],
    counts: Sequence[int],
    N: int,
    solved: int,
    levels: int = 0,
    bounds: int = 0,
    directed: int = 0,
) -> tuple[Arena, list[Span]]:
    """Returns an arena with the geometry of a robot and its tasks, and the rows of each task.

    Args:
        robot: gives the geometry.
        tasks: in the order of their rows.
        counts: number of rows of each task.
        N: knots.
        solved: number of rows of the tasks that are solved; these rows come first.
        levels, bounds, directed: number of each, see `sizes`.
    """
    frames = sorted({task.frame or robot.tip for task in tasks if isinstance(task, FrameTask)})
    python_rows = sum(count for task, count in zip(tasks, counts, strict=True) if not is_built_in(task))
    arena = sizes(
        robot.n,
        N,
        sum(counts),
        solved,
        levels,
        bounds or 2 * N,
        len(tasks),
        max(len(frames), 1),
        max(python_rows, 1),
        directed,
        robot.model.njoints,
    )
    _write_geometry(arena, robot, frames)
    spans, start, python_rows = [], 0, 0
    for index, (task, count) in enumerate(zip(tasks, counts, strict=True)):
        span = slice(start, start + count)
        spans.append((index, task, span))
        if is_built_in(task):
            _write_task(arena, robot, task, index, span, frames)
        else:
            arena.i["task"][index] = kinematics.PYTHON, 0, start, count
            arena.i["part"][span] = range(python_rows, python_rows + count)
            python_rows += count
        start += count
    return arena, spans


def write_limits(arena: Arena, limits: LimitsInForce, paper: bool) -> None:
    """Writes the bounds in force. With `paper` the position bounds are the position limits; otherwise they
    are the positions at which joints are stopped. Telemetry always gets the position limits."""
    q = limits.q_lower, limits.q_upper
    stops = q if paper else limits.stops
    arena.f["limits"][:] = limits.tau_lower, limits.tau_upper, limits.v_limit, *stops, limits.a_max, *q


def write_velocity_limits(arena: Arena, v_limit: Array) -> None:
    """Writes new velocity limits, (n,) rad/s; all other bounds stay as `write_limits` wrote them."""
    arena.f["limits"][2] = v_limit


def write_preview(arena: Arena, index: int, span: slice, preview: Preview, reach: int) -> None:
    """Writes the reference of a task at `reach` knots."""
    f = arena.f
    arena.i["law"][index] = SAMPLED
    if preview.value.ndim == 2:
        f["R_d"][index] = preview.value
    else:
        f["x_d"][span] = preview.value
    write_motion(arena, span, preview, reach)


def write_motion(arena: Arena, span: slice, preview: Preview, reach: int) -> None:
    """Writes the motion of a reference relative to its present value at `reach` knots. If the motion has a
    single knot, it is written to all knots."""
    motion = arena.f["motion"]
    motion[0, :, span] = preview.displacement[:reach]
    motion[1, :, span] = preview.velocity[:reach]
    motion[2, :, span] = preview.acceleration[:reach]


def write_curve(arena: Arena, index: int, span: slice, reference: Reference) -> bool:
    """Makes the kernel evaluate a task's reference from now on; returns False if the kernel does not support
    this reference."""
    curve, f = curve_of(reference), arena.f
    if curve is None or curve.centre.shape not in ((span.stop - span.start,), (3, 3)):
        return False
    arena.i["law"][index] = SAMPLED
    if curve.phase is None:
        zero = np.zeros((1, span.stop - span.start))
        write_preview(arena, index, span, Preview(curve.centre, zero, zero, zero), 1)
    else:
        arena.i["law"][index] = EASED if curve.phase.law == "eased" else UNIFORM
        f["pace"][index] = curve.phase.omega, curve.phase.offset
        for column, part in enumerate((curve.centre, *curve.swing)):
            f["curve"][span, column] = part
    return True


def _write_geometry(arena: Arena, robot: Robot, frames: Sequence[str]) -> None:
    f, i, tree = arena.f, arena.i, geometry(robot)
    i["parent"][:], i["is_revolute"][:] = tree.parent, tree.is_revolute
    i["column"][:], f["factor"][:] = tree.column, tree.factor
    f["rotation"][:], f["translation"][:], f["axis"][:] = tree.rotation, tree.translation, tree.axis
    for index, name in enumerate(frames):
        frame = robot.model.frames[robot.frame_id(name)]
        i["frame_joint"][index] = frame.parentJoint
        f["frame_rotation"][index], f["frame_translation"][index] = (
            frame.placement.rotation,
            frame.placement.translation,
        )


def _write_task(
    arena: Arena, robot: Robot, task: Task, index: int, span: slice, frames: Sequence[str]
) -> None:
    if isinstance(task, FrameTask):
        kind = kinematics.ORIENTATION if isinstance(task, FrameOrientation) else kinematics.POSITION
        frame, part = frames.index(task.frame or robot.tip), [AXES.index(axis) for axis in task.axes]
    else:
        assert isinstance(task, OnJoints)
        kind = kinematics.DAMPING if isinstance(task, Damping) else kinematics.JOINTS
        frame, part = 0, joint_indices(robot, task.joints)
    arena.i["task"][index] = kind, frame, span.start, span.stop - span.start
    arena.i["part"][span] = part
