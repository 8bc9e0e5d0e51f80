"""In the decoupled architecture of the delivery scene, either the base drives or the arm reaches, but never
both."""

from __future__ import annotations

import numpy as np

from himpc.htmpc import base_joints
from lessons.scenes.catalog import load_scene, prepared
from lessons.scenes.scene import VelocityScene
from lessons.session.velocity import VelocitySession

SETTLED = 12
"""Number of ticks after a new task in which the part that must be at rest may still be braking."""


def test_base_and_arm_take_turns() -> None:
    scene = prepared(load_scene("ridgeback-ur10-delivery"), None, ("architecture=decoupled",))
    assert isinstance(scene, VelocityScene)
    session = VelocitySession(scene)
    base = list(base_joints(session.robot))
    arm = [joint for joint in range(session.robot.n) if joint not in base]
    since, place, driven, reached = 0, -1, 0.0, 0.0
    for _ in range(150):
        session.tick()
        since = since + 1 if session.progress.l_0 == place else 0
        place = session.progress.l_0
        if session.progress.done or since < SETTLED:
            continue
        speed = np.abs(session.plant.v)
        if session.progress.window[0].task.role == "base":
            assert speed[arm].max() < 1e-3
            driven = max(driven, float(speed[base[:2]].max()))
        else:
            assert speed[base[:2]].max() < 1e-3
            reached = max(reached, float(speed[arm].max()))
    assert driven > 0.2
    assert reached > 0.05
