"""The errors of orientations and pointing axes decay in the closed loops of sessions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from himpc.kinematics.configuration import Configuration
from himpc.references import Circle, Phase
from himpc.rotation import exp3
from himpc.stack import Level
from himpc.tasks import (
    FrameOrientation,
    FramePosition,
    OrientationTask,
    Pointing,
    Posture,
    RelativeOrientation,
)
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession


@pytest.mark.parametrize(
    "turn",
    [
        FrameOrientation(name="turn", axes="xy"),
        RelativeOrientation(name="turn", root="link_2", axes="xy"),
    ],
    ids=["frame", "relative"],
)
def test_a_large_free_rotation_does_not_undo_the_orientation(turn: OrientationTask) -> None:
    """With K_p = 50 and K_v = 5 on x and y and a rotation of 120° about z, an error of 3° decays within a
    second. If its components were those of log₃, it would have grown to 14° (real part 1.6 1/s)."""
    scene = torque_scene("iiwa14-hold")
    levels = (Level((FramePosition(name="position"),)), Level((turn,)), Level((Posture(name="posture"),)))
    session = TorqueSession(replace(scene, settings=replace(scene.settings, stack=levels)))
    target = session.target("turn")
    assert target is not None
    z, x = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    target.jump(exp3(np.radians(3.0) * x) @ exp3(np.radians(-120.0) * z) @ target.raw)
    for _ in range(1000):
        session.tick()
    assert session.plan is not None
    assert np.degrees(np.linalg.norm(session.plan.errors["turn"])) < 0.5


def test_an_axis_follows_a_point_that_moves() -> None:
    """The point moves on a circle at 0.45 m/s, and the controller is model-based; without second-order terms
    the error would be 1.6°."""
    scene = torque_scene("iiwa14-hold")
    look = Pointing(name="look", K_p=50.0, K_v=14.0)
    levels = (Level((look,)), Level((FramePosition(name="position"),)), Level((Posture(name="posture"),)))
    here = Configuration(scene.robot, scene.robot.model.createData(), scene.q_0, scene.v_0)
    c, R = look.target(here), 0.15 * here.placement().rotation
    moving = {"look": Circle(c, R[:, 0], R[:, 1], Phase(3.0))}
    settings = replace(scene.settings, stack=levels, controller="hqp")
    session = TorqueSession(replace(scene, settings=settings, references=lambda robot, stack: moving))
    worst = 0.0
    for k in range(1500):
        session.tick()
        assert session.plan is not None
        if k >= 1000:
            worst = max(worst, float(np.linalg.norm(session.plan.errors["look"])))
    assert np.degrees(worst) < 0.2
