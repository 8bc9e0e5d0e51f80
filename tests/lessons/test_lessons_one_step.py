"""OSF, TDEOSF and HQP compute the same torques with the kinematics of the kernel and with those of
Pinocchio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from himpc.controllers.one_step import OneStepController
from lessons.events import MoveTarget, Set
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession


@pytest.mark.parametrize("controller", ["osf", "tdeosf", "osf_damped", "hqp"])
@pytest.mark.parametrize("name", ["iiwa14-circle", "iiwa14-hold", "planar3-circle", "ridgeback-ur10-hold"])
def test_torques_are_those_of_pinocchio_s_kinematics(
    monkeypatch: pytest.MonkeyPatch, name: str, controller: str
) -> None:
    """Two controllers receive the same states of a robot while targets are dragged and one level is disabled.
    Their torques agree to 1e-9 of the largest torque."""
    scene = torque_scene(name)
    session = TorqueSession(replace(scene, settings=replace(scene.settings, controller=controller)))
    other = TorqueSession(session.scene).controller
    assert isinstance(other, OneStepController)
    last = session.settings.levels[-1].name
    for k in range(30):
        if k == 2 and (target := session.target("position")) is not None:
            session.post(MoveTarget("position", tuple(target.value + 0.1)))
        if k == 15:
            session.post(Set(f"levels.{last}.enabled", False))
            session.drain()
            other.configure(session.settings.for_controller())
        monkeypatch.setattr(other, "_kinematics", None)
        state, tau_0 = session.plant.measure(1e-3), session.plant.tau
        previews = {key: each.preview(session.t, 1e-3, 5) for key, each in session.references.items()}
        printed = other.step(state.q, state.v, previews, tau_0)
        session.tick()
        compiled = session.plan
        assert compiled is not None
        largest = max(1.0, float(np.abs(printed.tau).max()))
        np.testing.assert_allclose(compiled.tau, printed.tau, rtol=0, atol=1e-9 * largest)
        assert compiled.values.keys() == printed.values.keys()
        for task, value in compiled.values.items():
            np.testing.assert_allclose(value, printed.values[task], atol=1e-12)
            np.testing.assert_allclose(compiled.errors[task], printed.errors[task], atol=1e-9)


def test_a_wild_torque_reading_does_not_raise_the_limit_of_hqp() -> None:
    """The first state is invalid, and a torque sensor reads thirteen times the limit. The torque that is held
    and the torques after it stay within the limit of the robot (found by `benchmarks.fuzz`)."""
    scene = torque_scene("iiwa14-hold")
    session = TorqueSession(replace(scene, settings=replace(scene.settings, controller="hqp")))
    limit = session.robot.tau_limit
    previews = {name: each.preview(0.0, 1e-3, 1) for name, each in session.references.items()}
    state = session.plant.measure(1e-3)
    for q in (np.full(7, np.nan), state.q, state.q):
        plan = session.controller.step(q, state.v, previews, 13.0 * limit)
        assert (np.abs(plan.tau) <= limit).all()
        assert (plan.limits.tau_upper <= limit).all() or not np.isfinite(q).all()
