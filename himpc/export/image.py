"""The memory of an exported controller: all its numbers, and their description."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any, get_type_hints

import numpy as np

from himpc.controllers.controller import Controller
from himpc.controllers.nhimpc import NHIMPC
from himpc.controllers.weighted import DAMPING_SHARE, Weighted
from himpc.export.entries import (
    ARRAYS,
    DIGEST,
    FIRST,
    JOINTS,
    LAYOUT,
    MAGIC,
    NAMES,
    SIGN,
    SIZE,
    WORDS,
    digest_of,
)
from himpc.export.kernel.loop_arrays import (
    BUDGET,
    DAMPS,
    DRAGGABLE,
    GUARD,
    LARGEST_ERROR,
    LEVELS,
    MARGIN,
    MOST,
    ON_ACCELERATION,
    PRESSING,
    ROWS,
    SHAPES,
    SIMPLE,
    STALL,
    TOLERANCE,
    UNGUARDED,
    WIDTH,
    LoopArrays,
    sizes_of,
)
from himpc.export.layout import layout_number
from himpc.export.refusals import check
from himpc.formulation.forms import StackForm, prepare, stack_form
from himpc.formulation.settings import Settings
from himpc.limits import in_force
from himpc.references import Reference, Target
from himpc.references.outlook import NOTHING, Observed
from himpc.stack import DAMPING_LEVEL, freedom_left
from himpc.tasks import Damping, Task
from himpc.tick.configure import Span, arena_for, write_curve, write_limits
from himpc.tick.distances import Distances, carried, pair_memory
from himpc.tick.kernel.arena import Arena, laid_out
from himpc.tick.kernel.arrays import NUMBERS, WHOLES, Array, TickArrays
from himpc.tick.tables import budget_of, write_numbers
from robots import InputError, Robot

_LINE = 64
"""Arrays begin at multiples of this number of bytes."""
MULTIPLE = 2.0
"""A setting may raise limits of torque and velocity to this multiple of the robot's own limits, which is also
the end of the page's sliders."""
_MOST_LEVELS = 10
"""Largest number of levels. Each further level doubles the size of the table of all sets of enabled
levels."""


@dataclass(frozen=True, eq=False)
class Image:
    """An exported controller.

    Attributes:
        memory: the bytes that a program copies to create a controller.
        manifest: the description of the bytes, as JSON.
    """

    memory: bytes
    manifest: dict[str, Any]


def image_of(
    controller: Controller,
    robot: Robot,
    references: Mapping[str, Reference],
    budget: float | None = None,
    multiple: float = MULTIPLE,
    observed: Observed = NOTHING,
) -> Image:
    """Returns the memory of a controller before its first period.

    Args:
        controller: HIMPC, HIQP, NHIMPC or Weighted.
        robot: the robot of the controller.
        references: the references of all tasks by name, before the first period.
        budget: largest number of multiplications for changes of active rows in a period; None: `budget_of`.
        multiple: see MULTIPLE. With an infinite number, a simulation may set any limits, also infinite ones.
        observed: the objects around the robot, in the order of OBJECT.

    Raises:
        InputError: the controller uses something that cannot be exported.
    """
    settings = controller.settings
    check(controller, settings)
    strict = not isinstance(controller, Weighted)
    form, off = _exported_levels(robot, settings, strict)
    count = len(form.levels)
    arena, spans = arena_for(robot, settings, form, off, count)
    write_numbers(arena, settings, form, alone=not strict)
    force = in_force(robot, settings.limits)
    write_limits(arena, force, settings.limits.position == "paper")
    arena.f["direction"][:] = np.eye(robot.n)
    sizes = sizes_of(robot.n, settings.horizon, len(arena.f["K_p"]), count, len(spans), len(arena.f["L"]))
    loop, loop_where, f = laid_out(SHAPES, sizes._asdict(), np.float64)
    f["setup"][[MOST, TOLERANCE]] = (
        (controller.max_iterations, controller.tolerance) if isinstance(controller, NHIMPC) else (1, np.inf)
    )
    f["setup"][[ON_ACCELERATION, LEVELS, DAMPS, BUDGET, SIMPLE]] = (
        *(settings.R_on == "acceleration", count, strict and settings.damping),
        *(budget_of(arena) if budget is None else budget, strict),
    )
    far = np.inf if np.isinf(multiple) else 0.0
    f["widest"][:2] = multiple * robot.tau_limit, multiple * robot.v_limit
    f["widest"][2:] = robot.q_lower - far, robot.q_upper + far
    f["order"][:] = f["solved_index"][:] = np.arange(count)
    f["goal"][:], f["tau_limit"][:], f["weight"][:] = arena.f["limits"], robot.tau_limit, 1.0
    for index, level in enumerate(form.levels):
        calmed = DAMPING_SHARE if level.name == DAMPING_LEVEL.name and not strict else 1.0
        f["Q"][level.rows] = calmed * level.root_Q**2
        R = level.R * np.array(settings.M_bar) ** 2 if settings.R_on == "acceleration" else level.R
        f["R"][index], f["enabled"][index] = R, level.level.enabled
        f["table"][index] = arena.i["level"][index]
    if strict:
        f["damped"][: 1 << len(settings.stack)] = _damped(robot, settings)
    pairs, known = pair_memory(robot.n, 0, 0, 0, 0, 0)[0], NOTHING
    if settings.limits.avoidance.on:
        distances, known = Distances(robot, settings.limits.avoidance), observed
        distances.observe(known)
        pairs = distances.arguments
    _write_guard(f, robot, settings)
    tasks = [_write_reference(arena, f, span, references) for span in spans]
    levels = [
        {"name": level.name, "index": index, "rows": level.rows.stop - level.rows.start}
        | {"tasks": [task.name for task in level.level.tasks], "enabled": level.level.enabled}
        for index, level in enumerate(form.levels)
    ]
    named = {
        "budget": float(f["setup"][BUDGET]),
        "controller": type(controller).__name__,
        "robot": robot.name,
        "joints": list(robot.joint_names),
        "period_s": settings.T_s,
        "horizon": settings.horizon,
        "layout": layout_number(),
        "tasks": tasks,
        "levels": levels,
        "objects": [shape.name for shape in known.shapes],
    }
    memory, offsets = _joined(
        (*arena.arguments, loop, loop_where, *pairs),
        robot.n,
        sha256(json.dumps(named).encode()).digest(),
    )
    digest = digest_of(memory)
    memory = memory[: 8 * DIGEST] + digest.to_bytes(8, "little") + memory[8 * DIGEST + 8 :]
    made = {"bytes": len(memory), "digest": f"{digest:016x}"}
    return Image(memory, named | made | {"arrays": _listed(arena, f, loop_where, offsets)})


def _exported_levels(robot: Robot, settings: Settings, strict: bool) -> tuple[StackForm, list[Task]]:
    """Returns the levels to export, for a strict hierarchy all levels, otherwise the enabled levels; and the
    tasks that are off."""
    if strict:
        levels = (*settings.stack, DAMPING_LEVEL) if settings.damping else settings.stack
        if len(levels) > _MOST_LEVELS:
            raise InputError(
                f"the stack has {len(settings.stack)} levels: export supports at most {_MOST_LEVELS}"
            )
        if not levels:
            raise InputError("the stack is empty and damping is off: export needs at least one level")
        return stack_form(robot, levels, settings), []
    form, idle, off = prepare(robot, settings)[:3]
    if idle:
        raise InputError("no level is enabled and damping is off: switch one level on to export it")
    return form, off


def _damped(robot: Robot, settings: Settings) -> list[float]:
    """Returns whether the damping level is added, for every set of enabled levels; bit k of the index stands
    for level k."""
    damped = []
    for choice in range(1 << len(settings.stack)):
        stack = tuple(
            replace(level, enabled=bool(choice >> index & 1)) for index, level in enumerate(settings.stack)
        )
        damped.append(float(settings.damping and freedom_left(robot, stack) > 0))
    return damped


def _write_reference(
    arena: Arena, f: dict[str, Array], where: Span, references: Mapping[str, Reference]
) -> dict[str, Any]:
    """Writes the reference of a task; returns the task's entry in the manifest."""
    index, task, span = where
    rows = span.stop - span.start
    entry: dict[str, Any] = {
        "name": task.name,
        "index": index,
        "first": span.start,
        "rows": rows,
        "unit": task.unit,
        "target": "none",
    }
    reference = references.get(task.name)
    if isinstance(task, Damping) or reference is None:
        return entry
    if isinstance(reference, Target):
        value, rotates = reference.raw, reference.raw.ndim == 2
        if rotates and rows < 3:
            # For an orientation on fewer than three axes, the motion of the reference depends on the robot's
            # configuration.
            arena.f["R_d"][index] = value
            return entry | {"target": "fixed"}
        m = 3 if rotates else rows
        f["target"][index, [DRAGGABLE, ROWS, WIDTH]] = 1.0, m, value.size
        f["raw"][index, : value.size] = value.ravel()
        caps = reference.caps
        f["caps"][index, :3] = caps.speed, caps.acceleration, caps.jerk
        f["samples"][index, 0, : value.size], f["samples"][index, 0, value.size + 3 * m] = value.ravel(), 1.0
        kind = "orientation" if rotates else "position" if task.unit == "m" else "joints"
        return entry | {"target": kind}
    if not write_curve(arena, index, span, reference):
        raise InputError(
            f"task '{task.name}' follows a {type(reference).__name__}, which cannot be exported: choose a "
            "scene whose references are circles, swings, constants or dragged targets"
        )
    return entry | {"target": "fixed"}


def _write_guard(f: dict[str, Array], robot: Robot, settings: Settings) -> None:
    """Writes which guard lowers velocity limits, see `himpc.controllers.stall_guard.guard_of`."""
    limits = settings.limits
    kind = STALL if limits.avoidance.on else PRESSING if limits.stall_guard else UNGUARDED
    f["setup"][[GUARD, MARGIN]] = kind, limits.avoidance.velocity_margin
    f["setup"][LARGEST_ERROR] = limits.avoidance.pull or np.inf
    f["carried"][:], f["v_limit"][:] = carried(robot), robot.v_limit


def _joined(arrays: Sequence[Any], n: int, names: bytes) -> tuple[bytes, dict[str, int]]:
    """Returns the words that describe where the arrays begin, followed by all arrays."""
    words, offsets, end = np.zeros(WORDS, np.int64), {}, 8 * WORDS
    pieces = []
    for index, (name, array) in enumerate(zip(ARRAYS, arrays, strict=True)):
        start = -(-end // _LINE) * _LINE
        pieces += [bytes(start - end), array.astype(array.dtype.newbyteorder("<")).tobytes()]
        offsets[name], end = start, start + array.nbytes
        words[FIRST + 2 * index : FIRST + 2 * index + 2] = start, array.size
    words[[MAGIC, LAYOUT, SIZE, JOINTS]] = SIGN, layout_number(), end, n
    words[NAMES] = int.from_bytes(names[:8], "little", signed=True)
    return words.astype("<i8").tobytes() + b"".join(pieces), offsets


def _listed(
    arena: Arena, f: dict[str, Array], loop_where: Array, offsets: dict[str, int]
) -> list[dict[str, Any]]:
    """Returns the name, type, shape, unit and first byte of every array."""
    tick = get_type_hints(TickArrays, include_extras=True)
    own = get_type_hints(LoopArrays, include_extras=True)
    entries = []
    kinds: Sequence[tuple[str, Any, Any, Any]] = (
        ("data", NUMBERS, arena.f, arena.where),
        ("whole", WHOLES, arena.i, arena.whole_where),
        ("loop", SHAPES, f, loop_where),
    )
    for part, names, arrays, where in kinds:
        for index, name in enumerate(names):
            hint = own[name] if part == "loop" else tick[name]
            entries.append(
                {
                    "name": name,
                    "part": part,
                    "type": "int64" if part == "whole" else "float64",
                    "shape": list(arrays[name].shape),
                    "unit": hint.__metadata__[1],
                    "offset": offsets[part] + 8 * int(where[index]),
                }
            )
    return entries
