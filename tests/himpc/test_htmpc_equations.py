"""The parts of HTMPC agree with independent evaluations: prediction (4), costs (8) and (10), rows (7d),
(12)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from htmpc_problems import FREE, at_home, mobile_settings, mobile_stack, point, previews

from himpc import FrameOrientation, FramePosition, Level
from himpc.htmpc import HTMPC, MotionLimits, base_joints, bounds
from himpc.htmpc.active_set import ActiveSetSolver
from himpc.htmpc.clearance import Avoidance, CollisionModel
from himpc.htmpc.cost import MU, ZETA, Effort, barrier, barrier_value
from himpc.htmpc.kernel.kinds import KINDS, LEXICOGRAPHIC
from himpc.htmpc.kinematics import Knots, desired_values
from himpc.htmpc.prediction import (
    Motion,
    Start,
    braking,
    integrator,
    positions,
    shifted,
    underway,
    velocities,
)
from himpc.htmpc.problem import Iterate, Problem, SharedStep
from himpc.htmpc.rows import ConstraintRows, ConstraintTable, limit_rows
from himpc.htmpc.settings import MotionBounds, efforts
from himpc.htmpc.tracking import Guard, Tracking, tracking
from himpc.references import Hold, Preview
from himpc.rotation import exp3, log3
from robots import InputError, Robot, load_robot
from robots.collision import Ball

Array = np.ndarray


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("ridgeback-ur10")


def numerical_gradient(f: Callable[[Array], float], x: Array, h: float = 1e-6) -> Array:
    return np.array([(f(x + h * e) - f(x - h * e)) / (2 * h) for e in np.eye(x.size)])


def start_of(robot: Robot, seed: int) -> Start:
    rng = np.random.default_rng(seed)
    n = robot.n
    return Start(robot.home + rng.normal(0, 0.1, n), rng.normal(0, 0.3, n), rng.normal(0, 0.3, n))


def tick_of(robot: Robot, **changes: object) -> SharedStep:
    settings = mobile_settings(**({"horizon": 4} | changes))
    start = start_of(robot, 0)
    limits = bounds(robot, settings.limits)
    tasks = tuple(task for level in settings.stack for task in level.tasks)
    goals = previews(at_home(robot, np.array([0.4, -0.2])), 0.0, settings)
    collision = CollisionModel(robot, settings.obstacles)
    table = ConstraintTable(settings.horizon * robot.n)
    return SharedStep(
        robot=robot,
        data=robot.model.createData(),
        settings=settings,
        start=start,
        desired={task.name: desired_values(task, goals[task.name], settings.horizon) for task in tasks},
        effort=Effort(efforts(robot, settings), settings.horizon, settings.dt),
        rows=limit_rows(start, settings.horizon, settings.dt, settings.period, limits, table),
        bounds=limits,
        plan=np.random.default_rng(9).normal(0, 0.5, (settings.horizon, robot.n)),
        avoidance=None if collision.empty else Avoidance(collision, settings.margin_m),
        method=ActiveSetSolver(),
        table=table,
    )


def slopes(at: Iterate, level: Tracking) -> Array:
    """Returns ∂e_k/∂u, (N, m, N·n)."""
    J, T_q = at.jacobian(level), integrator(4, 0.1).T_q
    return np.einsum("ks,kmj->kmsj", T_q, J).reshape(*J.shape[:2], -1)


# ------------------------------------------------------------------ prediction


def test_a_unicycle_is_refused() -> None:
    with pytest.raises(InputError, match="two prismatic joints"):
        mobile_settings(base="unicycle")


def test_base_joints_are_found_by_structure(robot: Robot) -> None:
    assert base_joints(robot) == (0, 1, 2)
    assert base_joints(load_robot("iiwa14")) == ()
    assert base_joints(load_robot("panda")) == ()


def test_prediction_is_the_integral_of_the_inputs(robot: Robot) -> None:
    start, U, dt = start_of(robot, 1), np.random.default_rng(1).normal(0, 1, (6, 9)), 0.07
    q, v, fine = start.q.copy(), start.v.copy(), 2000
    for k, u in enumerate(U):
        for _ in range(fine):  # midpoint rule, exact for a linear velocity
            q = q + dt / fine * (v + 0.5 * dt / fine * u)
            v = v + dt / fine * u
        np.testing.assert_allclose(positions(start, U, dt)[k], q, atol=1e-9)
        np.testing.assert_allclose(velocities(start, U, dt)[k], v, atol=1e-9)
    motion = Motion(start, U, dt)
    np.testing.assert_allclose(motion.position(3 * dt), positions(start, U, dt)[2], atol=1e-12)
    h = 1e-6
    for s in (0.0123, 0.2, 0.4):
        slope = (motion.position(s + h) - motion.position(s - h)) / (2 * h)
        np.testing.assert_allclose(slope, motion.velocity(s), atol=1e-6)


@pytest.mark.parametrize(("s", "N", "dt"), [(0.1, 6, 0.1), (0.02, 6, 0.1), (0.02, 12, 0.05), (0.3, 6, 0.1)])
def test_the_shifted_plan_has_the_old_plans_velocities(robot: Robot, s: float, N: int, dt: float) -> None:
    start, U = start_of(robot, 2), np.random.default_rng(2).normal(0, 0.5, (6, 9))
    before = Motion(start, U, 0.1)
    new = shifted(before, s, N, dt, bounds(robot, MotionLimits()))
    V = before.velocity(s) + dt * np.cumsum(new, axis=0)
    inside = [k for k in range(N) if s + (k + 1) * dt <= 0.6 + 1e-9]
    assert inside
    for k in inside:
        np.testing.assert_allclose(V[k], before.velocity(s + (k + 1) * dt), atol=1e-12)
    if len(inside) < N:  # beyond its end the old plan brakes
        assert np.linalg.norm(V[-1]) < np.linalg.norm(before.velocity(0.6))


def test_braking_comes_to_rest_inside_its_bounds(robot: Robot) -> None:
    limits = bounds(robot, MotionLimits())
    start = Start(robot.home, 0.95 * robot.v_limit * np.array([1, -1, 1, 1, -1, 1, -1, 1, 1]), np.zeros(9))
    U = braking(start, 40, 0.1, 0.1, limits)
    assert np.abs(velocities(start, U, 0.1)[-1]).max() < 0.05
    assert (np.abs(U) <= limits.a + 1e-12).all()
    assert (np.abs(np.diff(U, axis=0)) <= 0.1 * limits.j + 1e-12).all()


def test_a_joint_beyond_its_range_is_sent_back(robot: Robot) -> None:
    limits = bounds(robot, MotionLimits())
    q = robot.home.copy()
    q[3] = robot.q_upper[3] + 0.2
    start = Start(q, np.zeros(9), np.zeros(9))
    assert positions(start, braking(start, 30, 0.1, 0.1, limits), 0.1)[-1, 3] < robot.q_upper[3] + 0.1


def test_motion_under_way_is_what_was_commanded(robot: Robot) -> None:
    """The robot follows three plans for 0.1 s each; the motion over the last 0.17 s is computed."""
    rng = np.random.default_rng(4)
    plans, start = [], start_of(robot, 4)
    for _ in range(3):
        plans.append(Motion(start, rng.normal(0, 1, (3, 9)), 0.1))
        start = Start(plans[-1].position(0.1), plans[-1].velocity(0.1), plans[-1].U[0])
    expected = start.q - plans[1].position(0.03)
    np.testing.assert_allclose(underway(plans, 0.1, 0.17), expected, atol=1e-12)


# ------------------------------------------------------------------ costs


def test_effort_is_the_sum_it_is_written_as(robot: Robot) -> None:
    settings = mobile_settings(horizon=4)
    weights = efforts(robot, settings)
    np.testing.assert_allclose(weights.R, [0.1] * 3 + [0.02] * 6)
    np.testing.assert_allclose(weights.W, [0.1] * 3 + [0.0] * 6)
    effort, start = Effort(weights, 4, 0.1), start_of(robot, 5)
    U = np.random.default_rng(5).normal(0, 1, (4, 9))
    by_hand, last = 0.0, start.u
    for v, u in zip(velocities(start, U, 0.1), U, strict=True):
        by_hand += 0.5 * float(weights.S @ v**2 + weights.R @ u**2 + weights.W @ (u - last) ** 2)
        last = u
    value, slope = effort.absolute(start, U)
    assert value == pytest.approx(by_hand)
    numerical = numerical_gradient(lambda x: effort.absolute(start, x.reshape(4, 9))[0], U.ravel())
    np.testing.assert_allclose(slope, numerical, atol=1e-6)
    plan = U + 0.3
    value, slope = effort.relative(U, plan)
    numerical = numerical_gradient(lambda x: effort.relative(x.reshape(4, 9), plan)[0], U.ravel())
    np.testing.assert_allclose(slope, numerical, atol=1e-6)
    assert effort.relative(plan, plan)[0] == 0.0
    # Absolute and relative effort have the same Hessian.
    np.testing.assert_allclose(effort.hessian @ (U - plan).ravel(), slope, atol=1e-9)


def test_relaxed_barrier_is_the_logarithm_inside_and_a_parabola_outside() -> None:
    label = np.zeros(1, np.int64)
    for upper in (1.0, 2e-3, -0.5):
        rows = ConstraintRows(np.eye(1), np.array([-np.inf]), np.array([upper]), label, label, label)
        value, slope, curvature = barrier(rows, np.zeros(1))
        assert value == pytest.approx(barrier_value(rows, np.zeros(1)))
        numerical = numerical_gradient(lambda x, rows=rows: barrier_value(rows, x), np.zeros(1), 1e-7)
        np.testing.assert_allclose(slope, numerical, rtol=1e-5)
        h = 1e-5
        second = (barrier(rows, np.array([h]))[1] - barrier(rows, np.array([-h]))[1]) / (2 * h)
        np.testing.assert_allclose(curvature[0], second, rtol=1e-3)
        if upper == 1.0:
            assert value == pytest.approx(-MU * np.log(upper))
    edge = [
        barrier(
            ConstraintRows(np.eye(1), np.array([-np.inf]), np.array([h]), label, label, label), np.zeros(1)
        )
        for h in (ZETA * (1 - 1e-9), ZETA * (1 + 1e-9))
    ]
    for below, above in zip(*edge, strict=True):
        np.testing.assert_allclose(below, above, rtol=1e-6)


@pytest.mark.parametrize("formulation", ["paper", "proximal"])
@pytest.mark.parametrize("level", [0, 1])
def test_models_gradient_is_that_of_the_merit(robot: Robot, level: int, formulation: str) -> None:
    tick = tick_of(robot, formulation=formulation)
    settings = tick.settings
    problem = Problem(tick, tracking(robot, settings.stack[level], settings), (), formulation == "paper")
    U = 0.3 * np.random.default_rng(6).normal(0, 1, (4, 9))
    H, g = problem.model(tick.iterate(U))
    numerical = numerical_gradient(lambda x: problem.merit(tick.iterate(x.reshape(4, 9))), U.ravel())
    np.testing.assert_allclose(g, numerical, atol=2e-5)
    assert np.linalg.eigvalsh(H).min() > 0


def test_tracking_cost_counts_the_last_knot_as_terminal(robot: Robot) -> None:
    settings = mobile_settings(horizon=3, terminal=7.0)
    level = tracking(robot, settings.stack[1], settings)
    e = np.array([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]])
    assert level.cost(e) == pytest.approx(0.5 * 10.0 * ((e[:2] ** 2).sum() + 7.0 * (e[2] ** 2).sum()))


# ------------------------------------------------------------------ kinematics


def test_errors_and_their_jacobian(robot: Robot) -> None:
    tick = tick_of(robot)
    U = 0.5 * np.random.default_rng(7).normal(0, 1, (4, 9))
    for level in (tracking(robot, each, tick.settings) for each in tick.settings.stack):
        at = tick.iterate(U)
        e, E = at.errors(level), slopes(at, level)
        task = level.tasks[0]
        assert isinstance(task, FramePosition)
        for k, q in enumerate(positions(tick.start, U, 0.1)):
            goal = tick.desired[task.name][k + 1]
            np.testing.assert_allclose(e[k], point(robot, q, task.frame)[: len(goal)] - goal, atol=1e-12)
        for k in range(4):
            for p in range(e.shape[1]):
                numerical = numerical_gradient(
                    lambda x, k=k, p=p, level=level: tick.iterate(x.reshape(4, 9)).errors(level)[k, p],
                    U.ravel(),
                )
                np.testing.assert_allclose(E[k, p], numerical, atol=1e-7)


def test_previews_of_positions_and_rotations_become_goals() -> None:
    arm = load_robot("iiwa14")
    position, orientation = FramePosition(name="p"), FrameOrientation(name="o", axes="xz")
    displacement = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, -0.1]])
    goals = desired_values(position, Preview(np.ones(3), displacement, displacement, displacement), 1)
    np.testing.assert_allclose(goals[1], [1.1, 1.0, 0.9])
    R = exp3(np.array([0.3, -0.2, 0.5]))
    turn = np.array([[0.0, 0.0], [0.2, 0.1]])
    goals = desired_values(orientation, Preview(R, turn, turn, turn), 1)
    np.testing.assert_allclose(log3(goals[1] @ R.T), [0.2, 0.0, 0.1], atol=1e-12)
    needed = r"'p' has 2 samples, not 6: .* `previews\(references, t, dt, 5\)`"
    with pytest.raises(InputError, match=needed):
        desired_values(position, Preview(np.ones(3), displacement, displacement, displacement), 5)
    knots = Knots(arm, arm.model.createData(), arm.home[None])
    assert knots.errors(orientation, [R]).shape == (1, 2)


# ------------------------------------------------------------------ rows


def excess(start: Start, U: Array, dt: float, limits: MotionBounds) -> dict[str, float]:
    """Returns the largest violation of each kind of bound over joints and knots, computed from the motion
    itself."""
    q, v = positions(start, U, dt), velocities(start, U, dt)
    change = np.diff(np.vstack([start.u, U]), axis=0)
    return {
        "position": float(np.maximum(q - limits.q_upper, limits.q_lower - q).max()),
        "velocity": float((np.abs(v) - limits.v).max()),
        "acceleration": float((np.abs(U) - limits.a).max()),
        "jerk": float((np.abs(change) - limits.j * dt).max()),
    }


def violation(rows: ConstraintRows, u: Array) -> float:
    """Returns the largest violation of the bounds by u over all rows."""
    value = rows.A @ u
    return max(0.0, float(np.maximum(rows.lower - value, value - rows.upper).max(initial=0.0)))


def test_rows_hold_exactly_where_the_motion_stays_inside(robot: Robot) -> None:
    """Rows that no admissible input can reach are left out, so only admissible inputs are compared."""
    limits = bounds(robot, MotionLimits())
    rng = np.random.default_rng(8)
    seen: dict[str, int] = dict.fromkeys(("position", "velocity", "jerk"), 0)
    for case in range(60):
        start = start_of(robot, case)
        start = start._replace(v=rng.uniform(-1, 1, 9) * limits.v, u=rng.uniform(-1, 1, 9) * limits.a)
        start.q[3:] = rng.uniform(robot.q_lower[3:], robot.q_upper[3:])
        U = rng.uniform(-1, 1, (6, 9)) * limits.a
        rows = limit_rows(start, 6, 0.1, 0.1, limits)
        for kind, amount in excess(start, U, 0.1, limits).items():
            of_kind = rows.take(rows.kind == KINDS.index(kind))
            if abs(amount) > 1e-9:
                assert (violation(of_kind, U.ravel()) > 0) == (amount > 0), kind
            if amount > 1e-6:
                assert violation(of_kind, U.ravel()) == pytest.approx(amount)
                seen[kind] = seen.get(kind, 0) + 1
    assert min(seen.values()) > 3


def test_ramp_and_stop_rows_leave_a_way_on(robot: Robot) -> None:
    """After inputs inside all rows, the robot can brake without leaving velocity or position bounds."""
    limits = bounds(robot, MotionLimits())
    rng, checked = np.random.default_rng(10), 0
    for case in range(400):
        start = start_of(robot, case)
        start.q[3:] = rng.uniform(robot.q_lower[3:], robot.q_upper[3:])
        start = start._replace(v=rng.uniform(-1, 1, 9) * limits.v, u=np.zeros(9))
        U = rng.uniform(-1, 1, (2, 9)) * np.minimum(limits.a, 0.1 * limits.j)
        if violation(limit_rows(start, 2, 0.1, 0.1, limits), U.ravel()) > 0:
            continue
        checked += 1
        end = Start(positions(start, U, 0.1)[-1], velocities(start, U, 0.1)[-1], U[-1])
        tail = braking(end, 30, 0.1, 0.1, limits)
        found = excess(end, tail, 0.1, limits)
        assert found["velocity"] < 1e-9
        assert found["position"] < 0.02
    assert checked > 20


def test_widened_rows_contain_what_they_were_widened_for(robot: Robot) -> None:
    limits = bounds(robot, MotionLimits())
    start = start_of(robot, 11)._replace(v=2.0 * limits.v)
    rows = limit_rows(start, 5, 0.1, 0.1, limits)
    u = braking(start, 5, 0.1, 0.1, limits).ravel()
    assert violation(rows, u) > 0.1
    assert violation(rows.widened(u), u) == 0.0
    table = ConstraintTable(45)
    rows = limit_rows(start, 5, 0.1, 0.1, limits, table)
    table.about(u, len(rows.A))
    assert table.outside(len(rows.A)) == pytest.approx(violation(rows, u))
    around = table.changes(0, len(rows.A))
    assert violation(around, np.zeros_like(u)) == pytest.approx(violation(rows, u))
    assert violation(around, 0.3 * u) == pytest.approx(violation(rows, 1.3 * u))


# ------------------------------------------------------------------ lexicographic constraints


def test_guards_follow_12_and_11(robot: Robot) -> None:
    settings = mobile_settings(horizon=2)
    level = tracking(robot, settings.stack[1], settings)
    best = np.array([[0.1, -0.2], [0.0, 0.3]])
    guard = Guard(level, best)
    worse = np.array([[0.1, 0.25], [0.0, 0.1]])
    assert guard.excess(worse, True, 0.0) == pytest.approx(0.05)
    assert guard.excess(worse, True, 0.06) == pytest.approx(-0.01)
    change = level.cost(worse) - level.cost(best)
    assert guard.excess(worse, False, 0.0) == pytest.approx(change)
    weights = 10.0 * np.array([1, 1, 10, 10])
    assert guard.excess(worse, False, 0.1) == pytest.approx(change - 0.5 * weights.sum() * 0.01)


def test_guard_rows_always_contain_no_change(robot: Robot) -> None:
    """A zero step satisfies the guard rows, also if a level used its tolerance and |e| > |e*|."""
    tick = tick_of(robot)
    level = tracking(robot, tick.settings.stack[0], tick.settings)
    other = tracking(robot, tick.settings.stack[1], tick.settings)
    at = tick.iterate(0.2 * np.random.default_rng(12).normal(0, 1, (4, 9)))
    e, E = at.errors(level), slopes(at, level)
    for scale in (1.0, 0.5, 2.0):
        guard = Guard(level, scale * e)
        rows = Problem(tick, other, (guard,), True).rows(at)
        rows = rows.take(rows.kind == LEXICOGRAPHIC)
        assert (rows.lower <= 0.0).all()
        assert (rows.upper >= 0.0).all()
        assert guard.gap(e) >= 0.0
        # With strict rows, an error beyond e* must be removed again.
        assert (guard.gap(e, strict=True) < 0.0) == (scale < 1.0)
    below = Problem(tick, other, (Guard(level, e),), True)
    rows = below.rows(at)
    rows = rows.take(rows.kind == LEXICOGRAPHIC)
    np.testing.assert_allclose(rows.A, E.reshape(-1, 36), atol=1e-15)
    assert violation(rows, np.zeros(36)) == 0.0
    worse = np.asarray(np.linalg.lstsq(E.reshape(-1, 36), e.ravel(), rcond=None)[0], np.float64)
    assert violation(rows, 0.1 * worse) > 0.01
    assert violation(rows, -0.1 * worse) < 1e-9
    cost = tick_of(robot, lexicographic="cost")
    row = Problem(cost, below.level, (Guard(level, e),), True).rows(cost.iterate(at.U))
    row = row.take(row.kind == LEXICOGRAPHIC)
    weight = np.asarray(level.Q * e)
    np.testing.assert_allclose(row.A[0], np.einsum("km,kmj->j", weight, E), atol=1e-12)
    np.testing.assert_array_equal(row.upper, [0.0])


def test_too_many_coordinates_are_explained(robot: Robot) -> None:
    arm = load_robot("iiwa14")
    stack = (
        Level((FramePosition(name="p"), FrameOrientation(name="o"))),
        Level((FramePosition(name="elbow", frame="link_4", axes="x"),)),
    )
    with pytest.raises(InputError, match=r"6 .*\+ 1 .*= 7 coordinates, .*7 joints"):
        HTMPC(arm, mobile_settings(stack=stack))
    assert HTMPC(arm, mobile_settings(stack=stack[:1])) is not None


def test_avoidance_rows_predict_the_distance(robot: Robot) -> None:
    x, y, z = point(robot, robot.home)
    tick = tick_of(robot, obstacles=(Ball("ball", (x + 0.4, y, z), 0.1),), limits=FREE)
    U = 0.1 * np.random.default_rng(13).normal(0, 1, (4, 9))
    at = tick.iterate(U)
    assert tick.avoidance is not None
    assert at.near is not None
    rows = tick.avoidance.rows(at.near, 4, 0.1)
    d = 1e-4 * np.random.default_rng(14).normal(0, 1, 36)
    moved = tick.iterate(U + d.reshape(4, 9)).near
    assert moved is not None
    assert len(rows.A) == len(at.near.distance) == len(moved.distance) > 3
    np.testing.assert_allclose(at.near.distance + rows.A @ d, moved.distance, atol=1e-6)
    np.testing.assert_allclose(rows.lower, 0.05 - at.near.distance)


def test_braking_without_a_jerk_bound_is_finite(robot: Robot) -> None:
    limits = bounds(robot, FREE)
    start = Start(robot.home, np.where(np.arange(9) < 4, 0.5, 0.0), np.zeros(9))
    U = braking(start, 5, 0.1, 0.1, limits)
    np.testing.assert_allclose(velocities(start, U, 0.1)[-1], 0.0, atol=1e-12)


def test_mistakes_are_one_sentence(robot: Robot) -> None:
    for changes, words in (
        ({"horizon": 0}, "horizon is 0"),
        ({"dt": 0.0}, "dt is 0.0"),
        ({"formulation": "proxmal"}, "did you mean 'proximal'"),
        ({"lexicographic": "coordinate"}, "per_coordinate"),
        ({"delta_m": -1.0}, "delta_m is -1"),
        ({"gains": ()}, "gains"),
    ):
        with pytest.raises(InputError, match=words):
            mobile_settings(**changes)
    with pytest.raises(InputError, match="velocity_effort has 2 entries"):
        efforts(robot, mobile_settings(velocity_effort=(0.1, 0.1)))
    with pytest.raises(InputError, match="jerk_limit has 3 entries"):
        bounds(robot, MotionLimits(jerk_limit=(1.0, 1.0, 1.0)))
    with pytest.raises(InputError, match="Q of level 'base' has 3 entries"):
        level = mobile_stack()[1]
        tracking(robot, Level(level.tasks, Q=(1.0, 1.0, 1.0)), mobile_settings())
    assert Hold(np.zeros(2)).preview(0.0, 0.1, 3).displacement.shape == (4, 2)
