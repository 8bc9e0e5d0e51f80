"""A run's rows as named arrays: those of `himpc-lab run --npz`."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from lessons.events import as_data
from lessons.recording import torque, velocity
from lessons.recording.recording import Recording
from lessons.session.session import Session
from lessons.session.torque import TorqueSession
from lessons.session.velocity import VelocitySession

_PER_JOINT = (
    *("q", "v", "q_measured", "v_measured", "tau_0", "tau", "tau_demand"),
    *("tau_lower", "tau_upper", "v_limit", "q_lower", "q_upper"),
)
_MORE = ("acceleration", "jerk")
"""Per joint, where the kind has them."""
_CONSTANTS: Mapping[type[Session], Callable[[Any], dict[str, Any]]] = {
    TorqueSession: torque.constants,
    VelocitySession: velocity.constants,
}
_PER_TASK = ("x", "x_d", "v_d", "a_d", "error")


def arrays(recording: Recording, how: dict[str, Any]) -> dict[str, Any]:
    """One row per tick and field, and what reproduces the run. A field that the run's kind does not know is
    NaN: no torque bounds at velocity level.

    What an independent replay needs besides: `q_measured` and `v_measured` (what the controller was given),
    `tau_0` (the torque, at velocity level the command, that acted until the tick), the `tip`'s frame, `a_max`
    (n,), and the constants of the position bound: `position_margin` (rad), `position_reaction` (s) and
    `position_return_rate` (1/s) of `himpc.limits.viability`, NaN where it is not in force. x_d, v_d and
    a_d at the next knot are those of the next row.

    Args:
        recording: the run.
        how: scene, URDF, seed and settings as given, to which the event log is added.
    """
    session, layout = recording.session, recording.layout
    place = {level.name: index for index, level in enumerate(session.settings.levels, start=1)}
    unknown = np.full((len(recording.rows), session.robot.n), np.nan)
    data: dict[str, Any] = {"t": recording["t"][:, 0]}
    for name in (*_PER_JOINT, *(name for name in _MORE if name in layout.fields)):
        data[name] = recording[name] if name in layout.fields else unknown
    for task in layout.tasks:
        for name in _PER_TASK:
            data[f"{name}/{task.name}"] = recording[f"{name}/{task.name}"]
        level = f"level/{task.name}"
        data[level] = recording[level][:, 0] if level in layout.fields else np.array(place[task.level])
    data["joint_names"] = np.array(session.robot.joint_names)
    data["tip"] = np.array(session.robot.tip)
    data |= {name: np.array(value) for name, value in _CONSTANTS[type(session)](session).items()}
    events = [{"t": t, **as_data(event)} for t, event in session.log]
    told = {**how, "events": events, "in_force": session.settings.as_data()}
    data["settings"] = np.array(json.dumps(told))
    return data
