"""What the settings and the robot say, written into an arena: geometry, tasks, gains, bounds."""

from __future__ import annotations

from collections.abc import Sequence

from himpc.configuration import joint_indices
from himpc.controllers.forms import StackForm
from himpc.controllers.settings import Settings
from himpc.geometry import geometry
from himpc.limits import LimitsInForce
from himpc.limits.rows import approached, reaction, toeplitz
from himpc.tasks import Damping, FrameOrientation, FramePosition, Joints, Posture, Task
from himpc.tasks.frame import AXES, FrameTask
from himpc.tick.kernel import kinematics
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.bounds import OFF, PAPER, VIABILITY
from himpc.tick.tables import LevelTable, sizes, write_effects, write_levels
from robots import Robot

Span = tuple[int, Task, slice]
"""The place of a task among all, the task, and its rows."""

_BUILT_IN = (FramePosition, FrameOrientation, Joints, Posture, Damping)


def is_built_in(task: Task) -> bool:
    """Whether the kernel knows the task; its rows are handed in otherwise."""
    return type(task) in _BUILT_IN


def arena_for(
    robot: Robot, settings: Settings, form: StackForm, off: Sequence[Task], levels: Sequence[LevelTable]
) -> tuple[Arena, list[Span]]:
    """An arena with the tables of a robot and its settings, and where the rows of each task are.

    Args:
        robot, settings: as for a controller.
        form: the levels that are solved.
        off: tasks that are measured only.
        levels: what each level is to the kernel.
    """
    tasks = (*form.tasks, *off)
    counts = [*form.sizes, *(len(task.coordinates(robot)) for task in off)]
    frames = sorted({task.frame or robot.tip for task in tasks if isinstance(task, FrameTask)})
    given = sum(count for task, count in zip(tasks, counts, strict=True) if not is_built_in(task))
    N, solved = settings.horizon, sum(form.sizes)
    paper = settings.limits.position == "paper"
    arena = sizes(
        robot.n,
        N,
        sum(counts),
        solved,
        len(levels),
        (3 if paper else 2) * N,
        len(tasks),
        max(len(frames), 1),
        max(given, 1),
    )
    f = arena.f
    _write_geometry(arena, robot, frames)
    spans, start, given = [], 0, 0
    for place, (task, count) in enumerate(zip(tasks, counts, strict=True)):
        span = slice(start, start + count)
        spans.append((place, task, span))
        if is_built_in(task):
            _write_task(arena, robot, task, place, span, frames)
        else:
            arena.i["task"][place] = kinematics.GIVEN, 0, start, count
            arena.i["part"][span] = range(given, given + count)
            given += count
        start += count
    model = form.model
    f["M_bar"][:] = settings.M_bar
    f["K_p"][:solved], f["K_v"][:solved] = model.K_p, model.K_v
    f["on_velocity"][:, :solved], f["on_acceleration"][:, :solved] = model.on_velocity, model.on_acceleration
    for level in form.levels:
        write_effects(arena, level.rows, level.root_Q, level.weighted_C)
    write_levels(arena, levels)
    limits = settings.limits
    f["L"][:] = toeplitz(N, ("torque", "velocity", "position") if paper else ("torque", "velocity"))
    f["approach"][:] = approached(N, limits.velocity_approach * settings.T_s)[:, 0]
    f["scalars"][:3] = settings.T_s, settings.T_s, reaction(limits, settings.T_s)
    arena.i["sizes"][9] = {"viability": VIABILITY, "paper": PAPER, "off": OFF}[limits.position]
    return arena, spans


def write_limits(arena: Arena, limits: LimitsInForce, paper: bool) -> None:
    """The bounds in force; positions as they are for `paper`, else where joints are stopped."""
    stops = (limits.q_lower, limits.q_upper) if paper else limits.stops
    arena.f["limits"][:] = limits.tau_lower, limits.tau_upper, limits.v_limit, *stops, limits.a_max


def _write_geometry(arena: Arena, robot: Robot, frames: Sequence[str]) -> None:
    f, i, tree = arena.f, arena.i, geometry(robot)
    i["parent"][:], i["turns"][:] = tree.parent, tree.turns
    f["turn"][:], f["shift"][:], f["axis"][:] = tree.turn, tree.shift, tree.axis
    for place, name in enumerate(frames):
        frame = robot.model.frames[robot.frame_id(name)]
        i["frame_joint"][place] = frame.parentJoint
        f["frame_turn"][place], f["frame_shift"][place] = (
            frame.placement.rotation,
            frame.placement.translation,
        )


def _write_task(
    arena: Arena, robot: Robot, task: Task, place: int, span: slice, frames: Sequence[str]
) -> None:
    if isinstance(task, FrameTask):
        kind = kinematics.ORIENTATION if isinstance(task, FrameOrientation) else kinematics.POSITION
        frame, part = frames.index(task.frame or robot.tip), [AXES.index(axis) for axis in task.axes]
    else:
        assert isinstance(task, Joints)
        kind = kinematics.DAMPING if isinstance(task, Damping) else kinematics.JOINTS
        frame, part = 0, joint_indices(robot, task.joints)
    arena.i["task"][place] = kind, frame, span.start, span.stop - span.start
    arena.i["part"][span] = part
