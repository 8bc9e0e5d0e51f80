"""For every measurement at every tick, the command is finite and inside its bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from htmpc_problems import at_home, mobile_settings, previews
from hypothesis import given, settings
from hypothesis import strategies as st

from himpc.htmpc import HTIDKC, HTMPC, HTMPC_WPT, STMPC, Placo, VelocityPlan
from himpc.htmpc.settings import FORMULATIONS
from himpc.references import Hold
from robots import Robot, load_robot
from robots.collision import Ball

Array = np.ndarray
NEAR = np.array([-0.3, 0.4])
HOSTILE = (
    float("nan"),
    float("inf"),
    -float("inf"),
    1e308,
    -1e200,
    1e155,
    -1e20,
    1e9,
    -3e5,
    400.0,
    -60.0,
    8.0,
)
CONTROLLERS = (HTMPC, HTMPC_WPT, STMPC, HTIDKC, Placo)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("ridgeback-ur10")


def assert_permitted(robot: Robot, plan: VelocityPlan, period: float) -> None:
    """Checks all velocities that the servos receive in this period, and the accelerations between these
    velocities."""
    every = (plan.command, plan.u, plan.q, plan.v, *(level.final for level in plan.levels))
    assert all(np.isfinite(each).all() for each in every)
    for share in (0.01, 0.1, 0.5, 1.0):
        assert (np.abs(plan.motion.velocity(share * period)) <= robot.v_limit * (1 + 1e-9)).all()
    assert (np.abs(plan.command) <= robot.v_limit * (1 + 1e-9)).all()
    assert (np.abs(plan.u[0]) <= robot.a_max * (1 + 1e-9)).all()


@st.composite
def measurements(draw: st.DrawFn) -> tuple[dict[int, float], dict[int, float]]:
    """Returns changes of the measured positions and velocities of some joints."""
    wrong = st.dictionaries(st.integers(0, 8), st.sampled_from(HOSTILE), max_size=3)
    return draw(wrong), draw(wrong)


@settings(max_examples=40)
@given(
    kind=st.sampled_from(CONTROLLERS),
    formulation=st.sampled_from(FORMULATIONS),
    lexicographic=st.sampled_from(("per_coordinate", "cost")),
    rate_hz=st.sampled_from((10.0, 25.0)),
    delay_s=st.sampled_from((0.0, 0.05)),
    obstacle=st.booleans(),
    readings=st.lists(measurements(), min_size=1, max_size=4),
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_bounds_hold_on_every_command(
    robot: Robot, kind: Any, readings: list[tuple[dict[int, float], dict[int, float]]], **changes: Any
) -> None:
    """Every command is within its bounds: for valid measurements, for invalid ones, and when they are valid
    again."""
    balls = (Ball("ball", (1.0, 1.0, 0.8), 0.2),) if changes.pop("obstacle") else ()
    controller = kind(robot, mobile_settings(horizon=5, obstacles=balls, **changes))
    references, period = at_home(robot, NEAR), controller.settings.period
    calm: tuple[dict[int, float], dict[int, float]] = ({}, {})
    q, v = robot.home.copy(), np.zeros(9)
    for tick, (of_q, of_v) in enumerate([*readings[:1], calm, calm, *readings[1:], calm, calm, calm]):
        seen_q, seen_v = q.copy(), v.copy()
        for seen, wrong in ((seen_q, of_q), (seen_v, of_v)):
            for joint, value in wrong.items():
                seen[joint] += value
        plan = controller.step(seen_q, seen_v, previews(references, tick * period, controller.settings))
        assert_permitted(robot, plan, period)
        # The robot follows the command, starting from its true state.
        q, v = q + 0.5 * period * (v + plan.command), plan.command


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("speed", [1e200, 1e150, 1e6, 300.0])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_huge_speed_is_forgotten_at_the_next_tick(robot: Robot, formulation: Any, speed: float) -> None:
    """In an earlier version, one huge measured speed changed all later commands. Now the robot stays within
    centimetres of a robot without this measurement."""
    calm, hit = (HTMPC(robot, mobile_settings(formulation=formulation)) for _ in range(2))
    references = at_home(robot, NEAR)
    states = [(robot.home.copy(), np.zeros(9)) for _ in range(2)]
    for tick in range(15):
        for place, controller in enumerate((calm, hit)):
            q, v = states[place]
            seen = np.where(np.arange(9) == 4, speed, v) if controller is hit and tick == 4 else v
            plan = controller.step(q, seen, previews(references, 0.1 * tick, controller.settings))
            assert_permitted(robot, plan, 0.1)
            states[place] = plan.motion.position(0.1), plan.motion.velocity(0.1)
    np.testing.assert_allclose(states[1][0], states[0][0], atol=0.02)


@pytest.mark.parametrize("kind", CONTROLLERS)
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_hostile_references_leave_the_bounds_alone(robot: Robot, kind: Any, formulation: Any) -> None:
    controller = kind(robot, mobile_settings(formulation=formulation, horizon=4))
    q, v = robot.home.copy(), np.zeros(9)
    for tick, far in enumerate((0.1, 1e300, 0.1, 1e160, -1e12, float("nan"), 0.1, 1e6, 0.1, 0.1)):
        references = {"ee": Hold(np.full(3, far)), "base": Hold(np.full(2, -far))}
        plan = controller.step(q, v, previews(references, 0.1 * tick, controller.settings))
        for share in (0.1, 1.0):
            assert (np.abs(plan.motion.velocity(0.1 * share)) <= robot.v_limit * (1 + 1e-9)).all()
        assert (np.abs(plan.u[0]) <= robot.a_max * (1 + 1e-9)).all()
        q, v = plan.motion.position(0.1), plan.motion.velocity(0.1)


def test_a_push_beyond_the_speed_limit_is_not_commanded_on(robot: Robot) -> None:
    """The commanded speed is within the limit, although a push made the robot faster than this limit."""
    controller = HTMPC(robot, mobile_settings())
    references = at_home(robot, NEAR)
    for speed in (0.0, 3.0, 0.0):
        v = np.zeros(9)
        v[:2] = speed
        plan = controller.step(robot.home, v, previews(references, 0.0, controller.settings))
        assert_permitted(robot, plan, 0.1)


@pytest.mark.parametrize(("before", "after"), [(50.0, 10.0), (10.0, 50.0)])
def test_a_change_of_rate_is_not_taken_for_a_jump(robot: Robot, before: float, after: float) -> None:
    """Without a usable state, the controller assumes that the robot followed the last plan for the period
    that was set at that time."""
    controller = HTMPC(robot, mobile_settings(rate_hz=before))
    references = at_home(robot, NEAR)
    plan = controller.step(robot.home, np.full(9, 0.1), previews(references, 0.0, controller.settings))
    controller.configure(mobile_settings(rate_hz=after))
    nothing = np.full(9, np.nan)
    then = controller.step(nothing, nothing, previews(references, 1 / before, controller.settings))
    np.testing.assert_allclose(then.q[0], plan.motion.position(1 / before), atol=1e-12)
    np.testing.assert_allclose(then.v[0], plan.command, atol=1e-12)
