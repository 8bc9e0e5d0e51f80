"""A joint can always stop before its limit, lower and upper bounds never cross, and limits are tightened
without a jump."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc.compilation.compiled import plain
from himpc.limits import POSITION, TORQUE, VELOCITY, Limits, LimitsInForce, build_rows, in_force, ramp
from himpc.limits.limits import POSITION_MARGIN
from himpc.limits.rest import least_slack
from himpc.limits.velocity import RETURN_RATE, viability_bounds
from himpc.prediction import JointState
from himpc.tick.kernel.windup import taken_back
from robots import InputError, load_robot

Array = NDArray[np.float64]
seeds = st.integers(0, 2**32 - 1)


def bounds_at(
    q: float, low: float, high: float, v_max: float, a: float, reaction: float
) -> tuple[float, float]:
    one = np.ones(1)
    lower, upper = viability_bounds(q * one, low * one, high * one, v_max * one, a * one, reaction)
    return float(lower[0]), float(upper[0])


@given(
    seeds, st.floats(0.5, 6), st.floats(0.3, 10), st.floats(1, 40), st.floats(1e-3, 1e-2), st.floats(1, 50)
)
@settings(max_examples=100)
def test_a_joint_inside_the_viable_set_never_passes_its_limit(
    seed: int, span: float, v_max: float, a: float, T_s: float, later: float
) -> None:
    """For every desired velocity, braking with a_max keeps the double integrator inside its limits."""
    rng = np.random.default_rng(seed)
    low, high, reaction = -0.4 * span, 0.6 * span, T_s * later
    q = rng.uniform(low, high)
    v = rng.uniform(*bounds_at(q, low, high, v_max, a, reaction))
    outward, wanted = rng.random() < 0.5, 0.0
    for k in range(400):
        if k % 40 == 0:
            wanted = rng.uniform(-2, 2) * v_max if not outward else rng.choice([-1, 1]) * v_max
        # The joint keeps its velocity for one period and then brakes with a_max; the printed bound assumes
        # this.
        q += T_s * v
        lower, upper = bounds_at(q, low, high, v_max, a, reaction)
        assert lower <= upper
        # The bound must never require a deceleration greater than a_max.
        assert upper >= v - a * T_s - 1e-9 or v < 0
        assert lower <= v + a * T_s + 1e-9 or v > 0
        v = min(max(wanted, lower, v - a * T_s), upper, v + a * T_s)
        assert low - 1e-9 <= q <= high + 1e-9
        assert abs(v) <= v_max + 1e-9


@given(seeds, st.booleans())
@settings(max_examples=100)
def test_bounds_never_cross(seed: int, unbounded: bool) -> None:
    """For every joint, lower ≤ upper holds, also far beyond the limits and without limits."""
    rng = np.random.default_rng(seed)
    n = 6
    low, high = np.sort(rng.normal(0, 10 ** rng.uniform(-6, 2), (2, n)), axis=0)
    if unbounded:
        low[:2], high[1:3] = -np.inf, np.inf
    v_max = np.where(rng.random(n) < 0.2, np.inf, 10 ** rng.uniform(-2, 2, n))
    q = rng.normal(0, 10 ** rng.uniform(-3, 6), n)
    lower, upper = viability_bounds(q, low, high, v_max, 10 ** rng.uniform(-1, 2, n), 1e-3)
    assert (lower <= upper).all()
    assert not np.isnan([lower, upper]).any()


def test_beyond_a_limit_the_joint_must_return() -> None:
    """Beyond the limit, the bound requires a velocity towards the limit, in proportion to the excess and
    within the velocity limit."""
    assert bounds_at(1.1, -1.0, 1.0, 2.0, 10.0, 1e-3)[1] == pytest.approx(-RETURN_RATE * 0.1)
    assert bounds_at(-1.1, -1.0, 1.0, 2.0, 10.0, 1e-3)[0] == pytest.approx(RETURN_RATE * 0.1)
    assert bounds_at(9.0, -1.0, 1.0, 2.0, 10.0, 1e-3) == (-2.0, -2.0)


# ------------------------------------------------------------------ rows


@given(seeds, st.integers(1, 6), st.integers(1, 10), st.sampled_from(["viability", "paper", "off"]))
@settings(max_examples=100)
def test_rows_say_what_the_prediction_does(seed: int, n: int, N: int, position: Any) -> None:
    """A row is satisfied if and only if the predicted torque, velocity or position is inside its bound."""
    rng = np.random.default_rng(seed)
    T_s, M_bar = 1e-3, 10 ** rng.uniform(-3, 0, n)
    state = JointState(*rng.normal(0, [[1], [2], [30]], (3, n)))
    force = random_force(rng, n)
    limits = Limits(position=position, velocity_approach=0.0)
    tau_0, U = rng.normal(0, 5, n), rng.normal(0, 1, (N, n))
    rows = build_rows(state, tau_0, M_bar, limits, force, N, T_s)
    value = rows.L @ U
    assert rows.constraints == (TORQUE, VELOCITY, POSITION)[: 3 if position == "paper" else 2]
    np.testing.assert_allclose(rows.lower[:N], np.tile(force.tau_lower - tau_0, (N, 1)))
    v, q, a, tau = state.v.copy(), state.q.copy(), state.a.copy(), tau_0.copy()
    v_bounds = np.stack([-force.v_limit, force.v_limit])
    if position == "viability":
        low, high = force.q_lower + POSITION_MARGIN, force.q_upper - POSITION_MARGIN
        v_bounds = viability_bounds(state.q, low, high, force.v_limit, force.a_max, T_s)
    for j in range(N):
        tau, a, q = tau + U[j], a + U[j] / M_bar, q + T_s * v
        v = v + T_s * a
        np.testing.assert_allclose(rows.upper[j] - value[j], force.tau_upper - tau, atol=1e-9)
        room = (rows.upper[N + j] - value[N + j]) * T_s / M_bar
        np.testing.assert_allclose(room, v_bounds[1] - v, atol=1e-8)
        if position == "paper":
            room = (value[2 * N + j] - rows.lower[2 * N + j]) * T_s**2 / M_bar
            np.testing.assert_allclose(room, q - force.q_lower, atol=1e-8)


@pytest.mark.parametrize(
    ("position", "q", "upper", "lower"),
    [
        ("viability", 0.0, "velocity", "velocity"),
        ("viability", 0.98, "position", "velocity"),
        # beyond the limit the joint must return, within the velocity limit
        ("viability", 1.2, "position", "velocity"),
        ("paper", 0.98, "velocity", "velocity"),  # this variant has separate rows for positions
        ("off", 0.98, "velocity", "velocity"),
    ],
)
def test_a_velocity_row_tells_which_limit_it_stands_for(
    position: Any, q: float, upper: str, lower: str
) -> None:
    """With `viability`, a velocity row near the end of a joint stands for the position limit; the joint is
    at rest here."""
    one = np.ones(1)
    force = LimitsInForce(-9 * one, 9 * one, 0.5 * one, -one, one, 10 * one)
    state = JointState(q * one, 0 * one, 0 * one)
    rows = build_rows(state, 0 * one, one, Limits(position=position), force, 3, 1e-3)
    assert rows.constraint(4, 0, upper=True).label == upper
    assert rows.constraint(4, 0, upper=False).label == lower
    assert rows.constraint(1, 0, upper=True) is TORQUE
    assert rows.widened(np.zeros_like(rows.upper)).constraint(4, 0, upper=True).label == upper
    assert [rows.knot(row) for row in (0, 2, 3, 5)] == [0, 2, 1, 3]


def random_force(rng: np.random.Generator, n: int) -> LimitsInForce:
    tau = 10 ** rng.uniform(0, 2, n)
    low, high = np.sort(rng.normal(0, 2, (2, n)), axis=0)
    return LimitsInForce(-tau, tau, 10 ** rng.uniform(-1, 1, n), low, high, 10 ** rng.uniform(0, 1.5, n))


@given(seeds, st.integers(1, 8), st.sampled_from(["viability", "off"]), st.just(0.0) | st.floats(1, 1e4))
@settings(max_examples=100)
def test_rows_that_can_be_met_need_no_slack(seed: int, N: int, position: Any, approach: float) -> None:
    """For a robot inside its bounds with enough torque to stay there, the least slack is zero."""
    rng = np.random.default_rng(seed)
    n, T_s = 5, 1e-3
    M_bar = 10 ** rng.uniform(-3, 0, n)
    force = random_force(rng, n)
    q = rng.uniform(force.q_lower, force.q_upper)
    low, high = viability_bounds(q, force.q_lower, force.q_upper, force.v_limit, force.a_max, 0.06)
    state = JointState(q, 0.9 * rng.uniform(low, high), rng.normal(0, 5, n))
    tau_0 = 0.5 * rng.uniform(force.tau_lower, force.tau_upper)
    # The torque is enough to cancel q̈ and to brake with 200 1/s times the remaining velocity.
    strong = np.maximum(force.tau_upper, 2 * np.abs(tau_0) + 1e3 * (1 + np.abs(state.v) + np.abs(state.a)))
    force = LimitsInForce(-strong, strong, force.v_limit, force.q_lower, force.q_upper, force.a_max)
    limits = Limits(position=position, velocity_approach=approach)
    rows = build_rows(state, tau_0, M_bar, limits, force, N, T_s)
    assert least_slack(rows).max() <= 1e-9 * strong.max()


# ------------------------------------------------------------------ ramp


def force_of(**changes: float) -> LimitsInForce:
    values = {"tau": 10.0, "v": 2.0, "q_low": -1.0, "q_high": 1.0} | changes
    one = np.ones(1)
    return LimitsInForce(
        -values["tau"] * one, values["tau"] * one, values["v"] * one, values["q_low"] * one,
        values["q_high"] * one, 10 * one,
    )  # fmt: skip


FIELDS = ("tau_lower", "tau_upper", "v_limit", "q_lower", "q_upper")


def settled(now: LimitsInForce, goal: LimitsInForce, tau: float, q: float, v: float) -> list[LimitsInForce]:
    """Returns the limits in force at each tick, for a constant state, until they reach the goal."""
    path = [now]
    for _ in range(20_000):
        if path[-1] is goal:
            return path
        path.append(ramp(path[-1], goal, np.array([tau]), np.array([q]), np.array([v]), 1e-3))
    raise AssertionError("the limits never arrived")


def test_loosened_limits_hold_at_once() -> None:
    """Wider limits cannot be violated, so they apply at the next tick."""
    wide = force_of(tau=20.0, v=4.0, q_low=-2.0, q_high=2.0)
    assert len(settled(force_of(), wide, 9.0, 0.5, 1.0)) == 2


@given(st.floats(-10, 10), st.floats(-1, 1), st.floats(-2, 2))
@settings(max_examples=15)
def test_tightened_limits_close_in_and_arrive(tau: float, q: float, v: float) -> None:
    """In one tick, tightened limits do not pass the present value. They never become wider again, and reach
    the goal."""
    goal = force_of(tau=3.0, v=0.5, q_low=-0.2, q_high=0.3)
    path = settled(force_of(), goal, tau, q, v)
    seconds = 1e-3 * len(path)
    assert seconds <= 6.0
    first = path[1]
    # The first bounds contain the present state, except for the amount by which they shrink in one tick.
    share = 10.0 * 1e-3 / 0.5
    assert first.tau_upper[0] >= max(abs(tau), 3.0) - 10 * share
    assert first.tau_lower[0] <= -max(abs(tau), 3.0) + 10 * share
    assert first.v_limit[0] >= max(abs(v), 0.5) - 2 * share
    assert first.q_upper[0] >= max(q, 0.3) - share
    assert first.q_lower[0] <= min(q, -0.2) + share
    for before, after in pairwise(path[1:]):
        assert after.tau_upper[0] <= before.tau_upper[0]
        assert after.tau_lower[0] >= before.tau_lower[0]
        assert after.v_limit[0] <= before.v_limit[0]
        assert before.tau_upper[0] - after.tau_upper[0] <= 10 * share
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(path[-1], field), getattr(goal, field))


def test_limits_switched_on_start_from_the_present() -> None:
    """When limits are switched on, the first bound is the present value and not yet the limit."""
    nothing = force_of(tau=np.inf, v=np.inf, q_low=-np.inf, q_high=np.inf)
    first = ramp(nothing, force_of(), np.array([15.0]), np.array([1.4]), np.array([-3.0]), 1e-3)
    assert first.tau_upper[0] == pytest.approx(15.0, abs=0.05)
    # Both sides of a torque bound are tightened by the same amount.
    assert first.tau_lower[0] == -first.tau_upper[0]
    assert first.v_limit[0] == pytest.approx(3.0, abs=0.01)
    assert first.q_upper[0] == pytest.approx(1.4, abs=0.01)
    assert first.q_lower[0] == -1.0


# ------------------------------------------------------------------ settings


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("torque_scale", 0.0),
        ("torque_scale", np.nan),
        ("velocity_scale", -1.0),
        ("velocity_scale", np.inf),
        ("velocity_approach", -1.0),
        ("velocity_approach", np.nan),
        ("velocity_approach", 1e-200),
        ("position", "sometimes"),
    ],
)
def test_impossible_limits_are_refused(field: str, value: Any) -> None:
    """The message is one sentence that names the field."""
    with pytest.raises(InputError, match=field):
        Limits(**{field: value})


def test_scales_and_switches_reach_the_bounds_in_force() -> None:
    robot = load_robot("iiwa14")
    force = in_force(robot, Limits(torque_scale=0.5, velocity_scale=2.0))
    np.testing.assert_allclose(force.tau_upper, 0.5 * robot.tau_limit)
    np.testing.assert_allclose(force.tau_lower, -0.5 * robot.tau_limit)
    np.testing.assert_allclose(force.v_limit, 2 * robot.v_limit)
    np.testing.assert_allclose(force.q_upper, robot.q_upper)
    off = in_force(robot, Limits(torque=False, velocity=False, position="off"))
    assert all(np.isinf(getattr(off, field)).all() for field in FIELDS)


def test_an_arm_that_loses_its_contact_gains_the_speed_that_the_guard_assumes() -> None:
    """The torque that held the contact accelerates the arm until time-delay estimation has taken it back.
    From half of `taken_back` in every joint, the arm gains half of its velocity limits, whatever its inertia
    is."""
    rng, T_s = np.random.default_rng(3), 1e-3
    root = rng.normal(size=(4, 4))
    M = root @ root.T + np.eye(4)
    M_bar = 0.3 * np.linalg.eigvalsh(M)[0] * rng.uniform(0.5, 1.0, 4)
    v_limit = rng.uniform(1.0, 3.0, 4)
    tau, v = 0.5 * plain(taken_back)(M_bar, v_limit, T_s), np.zeros(4)
    for _ in range(20_000):
        a = np.linalg.solve(M, tau)
        v, tau = v + T_s * a, tau - M_bar * a
    assert v == pytest.approx(0.5 * v_limit, rel=1e-6)
