"""A velocity-level session runs in single commands, and its telemetry has additional fields for the page."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from himpc.constants import AT_VELOCITY
from himpc.htmpc import HTMPC, VelocityPlan
from himpc.telemetry import AT_ACCELERATION
from lessons.events import Event, MoveLevel, MoveTarget, Reset, Set
from lessons.scenes.catalog import as_torque_scene, load_scene, prepared
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import VelocityScene
from lessons.session.velocity import VelocitySession
from robots import InputError
from robots.reach import horizontal_reach

OUT_OF_REACH = MoveTarget("base", (-1.5, 0.0))
EVENTS: dict[int, Event] = {
    1: OUT_OF_REACH,
    5: Set("horizon", 6),
    9: MoveLevel("base", 0),
    14: Set("rate_hz", 20.0),
    20: Reset(),
}


def session(name: str, *assignments: str) -> VelocitySession:
    scene = prepared(load_scene(name), None, assignments)
    assert isinstance(scene, VelocityScene)
    return VelocitySession(scene, seed=3)


def timeless(made: VelocitySession, row: np.ndarray) -> np.ndarray:
    """Returns a row with zeros in place of the measured computing times."""
    kept = row.copy()
    for name, where in made.layout.fields.items():
        if "_us" in name:
            kept[where] = 0.0
    return kept


@pytest.mark.parametrize("mode", ["ideal", "servo"])
def test_command_by_command_is_the_same_run_to_the_last_bit(mode: str) -> None:
    """Runs by single commands and by whole ticks are bitwise equal, also if the page reads predictions in
    between. Events in the middle of a period take effect at the next control step."""
    how = (f"plant.mode={mode}", "plant.position_noise=0.001", "plant.lag_ms=30")
    whole, parts = session("ridgeback-ur10-drag", *how), session("ridgeback-ur10-drag", *how)
    for k in range(25):
        if k in EVENTS:
            whole.post(EVENTS[k])
        expected = timeless(whole, whole.tick())
        row, steps = None, 0
        while row is None:
            row = parts.advance()
            steps += 1
            assert parts.between == (row is None)
            parts.predicted_path("base")
            parts.binding()
            if steps == 3 and k + 1 in EVENTS:
                parts.post(EVENTS[k + 1])
        assert steps == (5 if k >= 14 else 10)
        assert np.array_equal(timeless(parts, row), expected, equal_nan=True)
        assert np.array_equal(parts.plant.q, whole.plant.q) and parts.t == whole.t
        assert parts.settings == whole.settings


def test_every_step_says_how_long_it_is() -> None:
    """The step length in the row is right also for the first step after a change of the rate."""
    made = session("ridgeback-ur10-drag")
    for rate in (10.0, 50.0, 12.0):
        made.post(Set("rate_hz", rate))
        made.drain()
        steps = [made.step_s]
        t = made.plant.t
        while made.advance() is None:
            steps.append(made.step_s)
        assert sum(steps) == pytest.approx(1 / rate, abs=1e-12)
        assert made.plant.t - t == pytest.approx(1 / rate, abs=1e-9)


def test_a_reset_between_two_commands_drops_the_rest_of_the_period() -> None:
    made = session("ridgeback-ur10-drag")
    first = timeless(made, made.tick())
    made.post(OUT_OF_REACH)
    for _ in range(14):
        made.advance()
    assert made.between
    made.reset()
    assert not made.between and made.t == 0.0
    assert np.array_equal(timeless(made, made.tick()), first, equal_nan=True)


# ---------------------------------------------------------------- telemetry


def test_the_bound_of_the_first_level_holds_and_the_last_level_has_none() -> None:
    made = session("ridgeback-ur10-drag", "delta_m=0.02")
    fields = made.layout.fields
    made.post(OUT_OF_REACH)
    rows = np.array([made.tick().copy() for _ in range(40)])
    plan = made.plan
    assert plan is not None
    best = plan.levels[0].best[0]
    bound, error = rows[:, fields["bound/ee"]][:, 0], np.linalg.norm(rows[:, fields["error/ee"]], axis=1)
    assert bound[-1] == np.linalg.norm(np.abs(best) + 0.02)
    assert (error[1:] <= bound[:-1]).all()
    assert np.isnan(rows[:, fields["bound/base"]]).all()
    made.post(Set("lexicographic", "cost"))
    assert np.isnan(made.tick()[fields["bound/ee"]]).all()


def test_joints_at_their_bounds_are_marked() -> None:
    """The base drives at its maximum speed and finally stops; joints are marked only at their bounds."""
    made = session("ridgeback-ur10-drag")
    fields = made.layout.fields
    made.post(MoveLevel("base", 0))
    made.post(MoveTarget("base", (-3.0, 0.0)))
    rows = np.array([made.tick().copy() for _ in range(70)])
    marks = rows[:, fields["at_bound"]].astype(int)
    speed = np.abs(rows[:, fields["tau"]]) / made.robot.v_limit
    push = rows[:, fields["acceleration"]] / made.bounds.a
    assert (marks[speed < 0.99] & AT_VELOCITY == 0).all() and (marks[speed > 0.9999] & AT_VELOCITY > 0).all()
    at_push = marks & AT_ACCELERATION
    assert (at_push[push < 0.99] == 0).all() and (at_push[push > 0.9999] > 0).all()
    assert np.count_nonzero(marks[:, 0] & AT_VELOCITY) > 10 and not marks[-1].any()


def test_manipulability_is_the_arms_and_falls_when_it_is_stretched() -> None:
    """The manipulability agrees with a Jacobian that is computed by differences, without the joints of the
    base."""
    made = session("ridgeback-ur10-drag")
    robot, data = made.robot, made.robot.model.createData()

    def tip(q: np.ndarray) -> np.ndarray:
        pin.framesForwardKinematics(robot.model, data, q)
        return data.oMf[robot.frame_id(robot.tip)].translation.copy()

    row = made.tick()
    q = row[made.layout.fields["q"]].copy()
    h = 1e-6 * np.eye(robot.n)
    J = np.array([(tip(q + h[k]) - tip(q - h[k])) / 2e-6 for k in range(3, robot.n)]).T
    at_home = float(row[made.layout.fields["manipulability"]][0])
    assert at_home == pytest.approx(np.sqrt(np.linalg.det(J @ J.T)), rel=1e-5)
    made.post(OUT_OF_REACH)
    for _ in range(60):
        row = made.tick()
    assert float(row[made.layout.fields["manipulability"]][0]) < 0.5 * at_home


def test_the_reach_circle_is_as_wide_as_the_arm_is_long() -> None:
    """The reach is 1.86 m from the axis of the base; the base stops when the hand is at about this
    distance."""
    made = session("ridgeback-ur10-drag")
    reach = horizontal_reach(made.robot, 3)
    assert reach == pytest.approx(1.86, abs=0.01)
    made.post(OUT_OF_REACH)
    row = [made.tick().copy() for _ in range(80)][-1]
    fields = made.layout.fields
    away = np.linalg.norm(row[fields["x/ee"]][:2] - row[fields["x/base"]])
    assert 0.95 * reach < away <= reach + 1e-3


def test_the_robot_feels_the_time_of_planning_if_asked_to(monkeypatch: pytest.MonkeyPatch) -> None:
    """With `delay_measured`, the commands of a plan are delayed by its computing time, and the controller
    expects the computing time of the previous plan. Without it, the plant has its own settings again."""
    made = session("ridgeback-ur10-square", "delay_measured=true", "plant.delay_ms=10")
    solve = HTMPC.step
    taken = iter((20_000.0, 60_000.0, 5e9, 20_000.0))

    def slow(self: HTMPC, *args: Any) -> VelocityPlan:
        return solve(self, *args)._replace(step_us=next(taken))

    monkeypatch.setattr(HTMPC, "step", slow)
    felt, expected = [], []
    for _ in range(3):
        made.tick()
        felt.append(made.plant.settings.delay_ms)
        assert made.controller is not None
        expected.append(made.controller.settings.delay_s)
    assert felt == [30.0, 70.0, 1000.0]
    assert expected == pytest.approx([0.01, 0.03, 0.07])
    made.post(Set("delay_measured", False))
    made.tick()
    assert made.plant.settings == made.settings.plant


def test_the_learner_reads_once_what_placo_says() -> None:
    """placo with a hard first level cannot follow a target that jumps far. The session says so once, until
    the settings change; the level shows its fallback at every tick, and the robot does not move."""
    made = session("iiwa14-htmpc", "controller=placo", "first_level=hard")
    made.tick()
    assert made.notices == []
    assert made.plan is not None
    x, y, z = made.plan.values["position"]
    made.post(MoveTarget("position", (x, y + 0.5, z)))
    rows = [made.tick().copy() for _ in range(20)]
    (notice,) = made.notices
    assert "placo found no velocity, and the robot brakes: Problem: Infeasible QP" in notice
    at = made.layout.fields
    keep = made.layout.fallbacks.index("keep")
    assert {float(row[at["fallback/position"]][0]) for row in rows} == {float(keep)}
    np.testing.assert_allclose(rows[-1][at["q"]], made.robot.home, atol=1e-9)
    made.post(Set("first_level", "scaled"))
    rows = [made.tick().copy() for _ in range(150)]
    assert len(made.notices) == 1
    assert np.linalg.norm(rows[-1][at["error/position"]]) < np.linalg.norm(rows[0][at["error/position"]]) / 2
    made.post(Set("first_level", "hard"))
    made.post(MoveTarget("position", (3.0, 0.0, 0.5)))
    made.tick()
    assert len(made.notices) == 2


def test_placo_is_not_exported() -> None:
    """Export takes torques: a scene at velocity level is refused, and placo at torque level as well."""
    velocities = RunSpec("iiwa14-htmpc", controller="placo").prepared()
    with pytest.raises(InputError, match="is driven by velocities; export takes torques"):
        as_torque_scene(velocities, "export")
    with pytest.raises(
        InputError, match="controller 'placo' commands velocities and scene 'iiwa14-hold' takes"
    ):
        RunSpec("iiwa14-hold", controller="placo").prepared()
