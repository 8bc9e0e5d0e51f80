"""In sessions, the compiled tick agrees with the printed equations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from printed_levels import off_printed

from himpc.plan import write_plan
from himpc.references import Outlook
from himpc.tick.kernel.control_period import control_period
from lessons.events import MoveTarget, Set
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession


@pytest.mark.parametrize("controller", ["himpc", "hiqp", "nhimpc", "weighted"])
@pytest.mark.parametrize(
    ("name", "horizon", "position"),
    [
        ("iiwa14-circle", 5, "viability"),
        ("iiwa14-circle-paper", 5, "viability"),
        ("iiwa14-circle-paper", 5, "paper"),
        ("iiwa14-hold", 3, "viability"),
        ("planar3-circle", 5, "viability"),
        ("planar3-conflict", 10, "viability"),
        ("planar3-singular", 5, "viability"),
        ("ridgeback-ur10-hold", 2, "viability"),
    ],
)
def test_torques_are_those_of_the_printed_equations(
    name: str, horizon: int, position: str, controller: str
) -> None:
    """Two closed loops, one with the kernel and one with the printed equations, agree while targets are
    dragged. HIQP is HIMPC with one knot. Of the other controllers, each level is compared."""
    scene = torque_scene(name)
    taken = replace(scene.settings, horizon=horizon, controller=controller)
    taken = taken.changed("limits.position", position)
    by_page = replace(taken, controller="himpc_printed", horizon=1 if controller == "hiqp" else horizon)
    compiled, printed = (TorqueSession(replace(scene, settings=each)) for each in (taken, by_page))
    worst, alone = 0.0, controller in ("nhimpc", "weighted")
    for k in range(60):
        for session in (compiled,) if alone else (compiled, printed):
            target = session.target("position")
            if k == 5 and target is not None:
                session.post(MoveTarget("position", tuple(target.value + 0.2)))
            session.tick()
        assert compiled.plan is not None
        if alone:
            worst = max(worst, off_printed(compiled.controller, compiled.plan))
            continue
        assert printed.plan is not None
        worst = max(worst, float(np.abs(compiled.plan.tau - printed.plan.tau).max()))
        for one, other in zip(compiled.plan.levels, printed.plan.levels, strict=True):
            assert one.fallback == "solve"
            assert one.leak <= 1e-6
            assert one.kkt_residual <= 1e-6
            assert one.cost == pytest.approx(other.cost, rel=1e-6, abs=1e-6)
    # One QP with all tasks in its cost has a larger condition number, and there the printed equations are
    # less exact. The same holds at the start of the paper, where J₁…J₃ have rank 6, if no bound limits the
    # directions that only rounding decides.
    loose = controller == "weighted" or (name, position) == ("iiwa14-circle-paper", "paper")
    assert worst <= (1e-7 if loose else 1e-8)


@pytest.mark.parametrize("controller", ["himpc", "himpc_printed"])
def test_a_wild_torque_reading_does_not_raise_the_limit(controller: str) -> None:
    """After a sensor reading of many times the limit of the robot, the next torques stay within the limit."""
    scene = torque_scene("planar3-hold")
    session = TorqueSession(replace(scene, settings=replace(scene.settings, controller=controller)))
    session.tick()
    previews = {name: each.preview(session.t, 1e-3, 5) for name, each in session.references.items()}
    for _ in range(3):
        state = session.plant.measure(1e-3)
        plan = session.controller.step(state.q, state.v, previews, 13.0 * session.robot.tau_limit)
        assert (np.abs(plan.tau) <= session.robot.tau_limit).all()


@pytest.mark.parametrize("name", ["planar3-circle", "iiwa14-hold"])
def test_changes_of_settings_act_alike(name: str) -> None:
    """A level's own horizon (Remark 8), a level that fades in, another horizon and another unit of R change
    the torques of himpc and of himpc_printed in the same way."""
    scene = torque_scene(name)
    compiled, printed = (
        TorqueSession(replace(scene, settings=replace(scene.settings, controller=controller)))
        for controller in ("himpc", "himpc_printed")
    )
    changes = {
        5: Set("levels.1.horizon", 2),
        10: Set("levels.2.enabled", False),
        20: Set("levels.2.enabled", True),
        50: Set("horizon", 7),
        60: Set("R_on", "acceleration"),
        70: Set("limits.position", "paper"),
    }
    worst = 0.0
    for k in range(80):
        for session in (compiled, printed):
            if k in changes:
                session.post(changes[k])
            session.tick()
        assert compiled.plan is not None and printed.plan is not None
        worst = max(worst, float(np.abs(compiled.plan.tau - printed.plan.tau).max()))
    assert not printed.notices
    assert worst <= 1e-8


def test_a_plan_that_is_kept_stays_as_it_is() -> None:
    """A frozen plan keeps the evidence of its own tick. If a plan is not frozen, access to its evidence
    raises an error later, and the message names `freeze`."""
    session = TorqueSession(torque_scene("iiwa14-circle"))
    session.tick()
    shown, other = session.plan, TorqueSession(torque_scene("iiwa14-circle"))
    other.tick()
    assert shown is not None
    assert other.plan is not None
    kept, late = replace(shown).freeze(), replace(shown)
    for _ in range(20):
        session.tick()
    for one, two in zip(kept.levels, other.plan.levels, strict=True):
        np.testing.assert_array_equal(one.U, two.U)
    np.testing.assert_array_equal(kept.q, other.plan.q)
    np.testing.assert_array_equal(late.tau, kept.tau)
    with pytest.raises(RuntimeError, match="freeze"):
        _ = late.levels


@pytest.mark.parametrize("controller", ["himpc", "nhimpc", "weighted"])
@pytest.mark.parametrize("name", ["iiwa14-circle", "iiwa14-circle-paper", "iiwa14-hold", "planar3-conflict"])
def test_a_row_gathered_at_once_is_the_row_written_field_by_field(name: str, controller: str) -> None:
    """The row of telemetry that the kernel writes at once equals the row that is written from the evidence of
    the plan."""
    scene = torque_scene(name)
    session = TorqueSession(replace(scene, settings=replace(scene.settings, controller=controller)))
    session.post(Set("limits.velocity_scale", 0.3))  # with this setting, bounds are active
    session.post(Set("limits.position", "viability"))
    target = session.target("orientation")
    if target is not None:
        target.move(pin.exp3(np.array([0.4, -0.2, 1.5])) @ target.value)
    binding = 0
    for k in range(40):
        session.tick()
        plan = session.plan
        assert plan is not None
        assert plan.fill is not None
        previews = Outlook(session.references, session.t - session.settings.T_s, session.settings.T_s, 5)
        gathered, by_field = np.empty((2, session.layout.size))
        write_plan(gathered, session.layout, plan, previews)
        write_plan(by_field, session.layout, replace(plan, fill=None), previews)
        if k % 10 == 9:
            np.testing.assert_allclose(gathered, by_field, rtol=0, atol=1e-12)
        binding += bool(gathered[session.layout.fields["at_bound"]].any())
    assert binding or not name.startswith("iiwa14-circle")


def test_nothing_is_compiled_while_a_robot_moves() -> None:
    """One compiled version of the entry function serves every layout."""
    for name in ("iiwa14-circle", "planar3-hold"):
        TorqueSession(torque_scene(name)).tick()
    assert len(control_period.signatures) == 1
