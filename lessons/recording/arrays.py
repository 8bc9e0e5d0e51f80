"""A run's rows as named arrays, for `himpc-lab run --npz` and for the page."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from himpc.constants import RETURN_RATE
from himpc.htmpc.settings import bounds
from himpc.limits import POSITION_MARGIN, reaction
from himpc.telemetry import Layout
from lessons.events import Event, as_data
from lessons.settings.settings import SceneSettings
from lessons.settings.torque import TorqueSettings
from lessons.settings.values import finite
from lessons.settings.velocity import VelocitySettings
from robots import Robot
from robots.arrays import Array

if TYPE_CHECKING:
    from lessons.recording.run import Recording


_PER_JOINT = (
    *("q", "v", "q_measured", "v_measured", "tau_0", "tau", "tau_demand"),
    *("tau_lower", "tau_upper", "v_limit", "v_limit_lowered", "q_lower", "q_upper"),
)
_PER_TASK = ("x", "x_d", "v_d", "a_d", "error")


def arrays(recording: Recording, how: dict[str, Any]) -> dict[str, Any]:
    """Returns the arrays of a recording, see `named`; `how`: scene, URDF, seed and settings as the user gave
    them."""
    session = recording.session
    events = [(t, event) for t, event in session.log]
    return named(session.robot, session.settings, recording.layout, recording.rows, how, events)


def named(
    robot: Robot,
    settings: SceneSettings,
    layout: Layout,
    rows: Array,
    how: dict[str, Any],
    events: Iterable[tuple[float, Event]] | None = None,
) -> dict[str, Any]:
    """Returns every field of telemetry by its name, and the data that reproduce the run. A field that does
    not exist for this kind of run, such as torque bounds at velocity level, is NaN.

    More fields, for an independent replay:

    - `q_measured`, `v_measured`: the state that the controller received;
    - `tau_0`: the torque that acted until the tick; at velocity level, the command;
    - `tip`: the name of the frame; `a_max`: (n,);
    - `position_margin` (rad), `position_reaction` (s), `position_return_rate` (1/s): the constants of
      `himpc.limits.velocity`, NaN if this limit is not in force.

    The values of x_d, v_d and a_d at the next knot are in the next row.

    Args:
        robot, settings: those at the end of the run.
        layout, rows: the layout of the fields, and the rows, (k, size).
        how: data about the origin of the run, as the user gave them.
        events: (time in s, event) in order; None: not known.
    """
    data: dict[str, Any] = {name: rows[:, where] for name, where in layout.fields.items()}
    together = {*_PER_JOINT, *(f"{name}/{task.name}" for task in layout.tasks for name in _PER_TASK)}
    data = {
        name: values[:, 0] if values.shape[1] == 1 and name not in together else values
        for name, values in data.items()
    }
    unknown = np.full((len(rows), robot.n), np.nan)
    data |= {name: unknown for name in _PER_JOINT if name not in data}
    level_index = {level.name: index for index, level in enumerate(settings.levels, start=1)}
    for task in layout.tasks:
        data.setdefault(f"level/{task.name}", np.array(level_index[task.level]))
    data["joint_names"] = np.array(robot.joint_names)
    data["tip"] = np.array(robot.tip)
    data |= constants(robot, settings)
    metadata = {**how, "in_force": settings.as_data()}
    if events is not None:
        metadata["events"] = [{"t": t, **as_data(event)} for t, event in events]
    data["settings"] = np.array(json.dumps(finite(metadata)))
    return data


def constants(robot: Robot, settings: SceneSettings) -> dict[str, Any]:
    """a_max, (n,) rad/s² (m/s²), and the constants of the bound that stops a joint before its limit: margin
    (rad), reaction (s) and return rate (1/s); NaN if this bound is not in force. It is never in force at
    velocity level."""
    a_max, *bound = _OF[type(settings)](robot, settings)
    names = ("position_margin", "position_reaction", "position_return_rate")
    return {"a_max": np.array(a_max), **dict(zip(names, map(np.array, bound), strict=True))}


def _torque(robot: Robot, settings: TorqueSettings) -> tuple[Any, ...]:
    if settings.limits.position != "viability":
        return robot.a_max, np.nan, np.nan, np.nan
    return robot.a_max, POSITION_MARGIN, reaction(settings.limits, settings.T_s), RETURN_RATE


def _velocity(robot: Robot, settings: VelocitySettings) -> tuple[Any, ...]:
    return bounds(robot, settings.htmpc.limits).a, np.nan, np.nan, np.nan


_OF: Mapping[type[SceneSettings], Callable[[Robot, Any], tuple[Any, ...]]] = {
    TorqueSettings: _torque,
    VelocitySettings: _velocity,
}


def as_npz(data: dict[str, Any]) -> bytes:
    """Arrays as the bytes of a compressed .npz file."""
    memory = io.BytesIO()
    np.savez_compressed(memory, **data)
    return memory.getvalue()


def as_csv(layout: Layout, rows: Array) -> bytes:
    """Returns one line per row, one column per number. The heading is the field's name; if the field has
    several numbers, the number's name follows in brackets. SI units; orientations are quaternions x y z w. An
    empty cell stands for a number that is not defined."""
    heads: list[str] = []
    for name, where in layout.fields.items():
        width = where.stop - where.start
        heads += [name] if width == 1 else [f"{name}[{which}]" for which in _words(layout, name, width)]
    lines = [",".join(heads)]
    lines += [",".join("" if cell != cell else f"{cell:.9g}" for cell in row) for row in rows.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _words(layout: Layout, field: str, width: int) -> tuple[str, ...]:
    """Returns names of a field's numbers."""
    kind, _, name = field.partition("/")
    if not name:
        return layout.joints
    task = next(task for task in layout.tasks if task.name == name)
    if width == len(task.coordinates) and not (kind in ("x", "x_d") and width == 4):
        return task.coordinates
    return ("x", "y", "z", "w")[:width]
