"""In closed loop, tasks of every kind hold a robot at rest, and reach a target that is dragged a little."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from himpc.rotation import exp3, quaternion
from lessons.events import MoveTarget
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession

Array = NDArray[np.float64]

KINDS: dict[str, tuple[dict[str, Any], float]] = {
    "position": ({}, 1e-3),
    "orientation": ({}, np.radians(0.1)),
    "joints": ({"joints": ["joint_2"]}, np.radians(0.1)),
    "posture": ({}, np.radians(0.1)),
    "com": ({"axes": "xz"}, 1e-3),
    "relative_position": ({"root": "link_2", "axes": "xz"}, 1e-3),
    "relative_orientation": ({"root": "link_2", "axes": "xy"}, np.radians(0.1)),
    "pointing": ({"frame": "link_6"}, np.radians(0.1)),
    "plane_distance": ({"normal": [0.0, 0.6, 0.8]}, 1e-3),
}
"""Per kind: its fields, and the tolerance within which the error must settle, m or rad."""


def dragged(raw: Array) -> tuple[float, ...]:
    """Returns a target that is about 2 cm or 3° away from the given one."""
    return tuple(quaternion(exp3(np.array([0.05, -0.03, 0.0])) @ raw) if raw.ndim == 2 else raw + 0.02)


@pytest.mark.parametrize(
    ("kind", "controller"),
    [(kind, "himpc") for kind in KINDS]
    + [("position", "hqp"), ("orientation", "hqp")]
    + [
        pytest.param(kind, "hqp", marks=pytest.mark.nightly("himpc/tasks", "himpc/controllers"))
        for kind in list(KINDS)[2:]
    ],
)
def test_every_kind_holds_and_follows(kind: str, controller: str) -> None:
    scene = torque_scene("iiwa14-hold")
    fields, tolerance = KINDS[kind]
    stack = [{"task": kind, "name": "x", **fields}, {"task": "damping"}]
    settings = scene.settings.changed("stack", stack).changed("controller", controller)
    session = TorqueSession(replace(scene, settings=settings))
    hold = [session.tick()[session.layout.fields["error/x"]].copy() for _ in range(100)]
    assert np.abs(hold).max() < tolerance
    target = session.target("x")
    assert target is not None
    session.post(MoveTarget("x", dragged(target.raw)))
    row = [session.tick() for _ in range(1600)][-1]
    goal = session.target("x")
    assert goal is not None
    np.testing.assert_allclose(goal.value, goal.raw, atol=1e-6)
    assert np.abs(row[session.layout.fields["error/x"]]).max() < tolerance
    assert session.diverged_at is None
    assert session.notices == []
