"""HIMPC runs in the sessions of scenes with all horizons, a full stack, and active constraints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from session_rows import field, rows_of

from himpc import Joints, Level
from lessons.events import MoveTarget, Set
from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession


def test_six_joints_under_a_full_stack(example_urdf: Callable[[str], str]) -> None:
    """On an arm with six joints and 3+3+1 rows, level 3 has no freedom; it changes nothing and raises no
    error."""
    scene = torque_scene("hold", example_urdf("ur_description/urdf/ur10_robot.urdf"))
    assert scene.robot.n == 6
    third = Level((Joints(name="q1", joints=scene.robot.joint_names[:1]),))
    settings = replace(scene.settings, stack=(*scene.settings.levels[:2], third))
    for controller in ("himpc", "himpc_printed"):
        session = TorqueSession(replace(scene, settings=replace(settings, controller=controller)))
        start = session.robot.home
        session.post(Set("levels.q1.K_p", 400))
        rows = rows_of(session, 300)
        assert session.plan is not None
        assert [level.name for level in session.plan.levels] == ["position", "orientation", "q1"]
        last = session.plan.levels[-1]
        assert (last.fallback, last.status) == ("solve", "empty")
        np.testing.assert_array_equal(last.U, session.plan.levels[1].U)
        assert np.nanmax(field(session, rows, "priority_leak")) <= 1e-6
        assert np.nansum(field(session, rows, "unsolved")) == 0
        assert np.abs(session.plant.q - start).max() < 0.02


def test_binding_constraints_are_named(scene: TorqueScene) -> None:
    """During a fast motion with an active velocity bound, the plan names level, joint, kind, side and
    multiplier."""
    session = TorqueSession(scene)
    session.post(Set("limits.velocity_scale", 0.05))
    session.tick()
    session.post(MoveTarget("position", (0.4, 0.4, 0.5)))
    rows_of(session, 900)
    bindings = session.binding()
    assert bindings
    first = bindings[0]
    assert first.level in ("position", "orientation", "posture")
    assert first.joint in session.robot.joint_names
    assert {binding.kind for binding in bindings} == {"velocity"}
    assert first.side in ("upper", "lower")
    assert first.multiplier > 0
    assert abs(first.slack) < 1e-6
    assert 1 <= first.knot <= session.settings.horizon
