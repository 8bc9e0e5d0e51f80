"""The tests show how HIQP, NHIMPC and the weighted controller differ from HIMPC."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from control_loop import holds, iiwa_settings
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from problems import quadratic, random_hierarchy

from himpc import CONTROLLERS, HIMPC, Settings
from himpc.controllers import HIQP, NHIMPC, Weighted, make_controller
from himpc.controllers.nhimpc import MAX_ITERATIONS
from himpc.controllers.weighted import sum_of_costs
from himpc.kinematics.configuration import Configuration
from himpc.plan import Plan
from himpc.references import Preview
from himpc.stack import Level
from robots import Robot

Array = NDArray[np.float64]

VARIANTS = {"hiqp": HIQP, "nhimpc": NHIMPC, "weighted": Weighted}


def moved(robot: Robot, N: int) -> dict[str, Preview]:
    """Returns previews of a target that is 5 cm away and moves at 0.3 m/s, so that the first plan differs
    strongly from the prediction before it."""
    previews = holds(robot, N)
    there = previews["position"]
    velocity = np.tile([0.0, 0.3, -0.1], (N + 1, 1))
    previews["position"] = Preview(
        there.value + np.array([0.0, 0.05, 0.02]),
        np.outer(1e-3 * np.arange(N + 1), velocity[0]),
        velocity,
        there.acceleration,
    )
    return previews


def first_plan(controller: HIMPC, previews: dict[str, Preview]) -> Plan:
    robot = controller.robot
    controller.reset(np.zeros(robot.n))
    return controller.step(robot.home, np.linspace(0.6, -0.6, robot.n), previews)


def alone(settings: Settings, levels: int) -> Settings:
    """Returns the settings with only the first levels enabled, and without a damping level."""
    stack = tuple(replace(level, enabled=place < levels) for place, level in enumerate(settings.stack))
    return replace(settings, stack=stack, damping=False)


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_is_made_by_its_name(iiwa: Robot, name: str) -> None:
    assert name in CONTROLLERS
    assert type(make_controller(name, iiwa, iiwa_settings(iiwa))) is VARIANTS[name]


@pytest.mark.parametrize("name", VARIANTS)
def test_whatever_comes_in_the_torque_is_finite_and_in_bounds(iiwa: Robot, name: str) -> None:
    """For any state the variants raise no exception, and no torque is NaN or exceeds its bound."""
    controller = make_controller(name, iiwa, iiwa_settings(iiwa))
    rng = np.random.default_rng(0)
    for size in (0.1, 10.0, 1e4, 1e12, np.nan, 1.0):
        q, v = size * rng.normal(size=7), size * rng.normal(size=7)
        plan = controller.step(q, v, moved(iiwa, 5))
        assert (np.abs(plan.tau) <= iiwa.tau_limit).all()


# ------------------------------------------------------------------ HIQP


def test_hiqp_is_himpc_with_one_knot(iiwa: Robot) -> None:
    """Over many ticks, the torques are bitwise equal for every horizon in the settings, also after the
    horizon changes."""
    one = HIMPC(iiwa, iiwa_settings(iiwa, horizon=1))
    hiqp = HIQP(iiwa, iiwa_settings(iiwa, horizon=5))
    v = np.linspace(0.6, -0.6, 7)
    for tick in range(30):
        N = 5 if tick < 15 else 9
        if tick == 15:
            hiqp.configure(iiwa_settings(iiwa, horizon=9))
        q = iiwa.home + 1e-3 * tick * v
        expected = one.step(q, v, moved(iiwa, 1))
        found = hiqp.step(q, v, moved(iiwa, N))
        np.testing.assert_array_equal(found.tau, expected.tau)
        assert found.q.shape == (2, 7)


# ------------------------------------------------------------------ NHIMPC


def own_leak(robot: Robot, settings: Settings, plan: Plan) -> float:
    """Returns ‖J_p(q_{k+j|k}) M̄⁻¹(Δτ_i − Δτ_p)‖∞, the leak of (33) with the Jacobians along the prediction
    of the plan itself."""
    along = Configuration(robot, robot.model.createData(), plan.q[0], plan.q[0], plan.q[1:-1])
    leak = 0.0
    for p, level in enumerate(settings.stack[:-1]):
        J = np.concatenate([task.jacobian(along) for task in level.tasks], axis=1)
        for lower in plan.levels[p + 1 :]:
            change = (lower.U - plan.levels[p].U) / np.array(settings.M_bar)
            leak = max(leak, float(np.abs(J @ change[:, :, None]).max()))
    return leak


def test_nhimpc_keeps_the_priorities_along_its_own_prediction(iiwa: Robot) -> None:
    """(33) holds with the Jacobians along the plan itself; HIMPC uses the Jacobians of the previous plan and
    violates it."""
    settings = iiwa_settings(iiwa, horizon=20)
    previews = moved(iiwa, 20)
    nonlinear, linear = (
        first_plan(NHIMPC(iiwa, settings), previews),
        first_plan(HIMPC(iiwa, settings), previews),
    )
    assert own_leak(iiwa, settings, nonlinear) < 1e-6
    assert own_leak(iiwa, settings, linear) > 1e3 * own_leak(iiwa, settings, nonlinear)
    assert 2 <= nonlinear.iterations < MAX_ITERATIONS
    assert linear.iterations == 1


def test_one_iteration_of_nhimpc_is_himpc(iiwa: Robot) -> None:
    settings, previews = iiwa_settings(iiwa), moved(iiwa, 5)
    expected = first_plan(HIMPC(iiwa, settings), previews)
    found = first_plan(NHIMPC(iiwa, settings, max_iterations=1), previews)
    np.testing.assert_array_equal(found.tau, expected.tau)
    assert found.iterations == 1


def test_the_tolerance_of_nhimpc_is_kept(iiwa: Robot) -> None:
    """A loose tolerance needs fewer iterations, and its error is at most the tolerance."""
    settings, previews = iiwa_settings(iiwa, horizon=20), moved(iiwa, 20)
    exact = first_plan(NHIMPC(iiwa, settings, tolerance=1e-12), previews)
    loose = first_plan(NHIMPC(iiwa, settings, tolerance=1e-2), previews)
    usual = first_plan(NHIMPC(iiwa, settings), previews)
    assert loose.iterations < exact.iterations
    for plan, tolerance in ((loose, 1e-2), (usual, 1e-6)):
        pairs = zip(plan.levels, exact.levels, strict=True)
        assert max(np.abs(one.U - other.U).max() for one, other in pairs) <= tolerance


def test_a_level_fades_in_as_fast_as_under_himpc(iiwa: Robot) -> None:
    """The weight of a level that was just enabled grows once in each tick, not in each iteration."""
    settings = iiwa_settings(iiwa)
    plans = []
    for kind in (HIMPC, NHIMPC):
        controller = kind(iiwa, alone(settings, 2))
        controller.step(iiwa.home, np.zeros(7), holds(iiwa, 5))
        controller.configure(settings)
        previews = holds(iiwa, 5)
        rest = previews["q1"]
        previews["q1"] = Preview(rest.value + 0.5, rest.displacement, rest.velocity, rest.acceleration)
        plans.append([controller.step(iiwa.home, np.zeros(7), previews, np.zeros(7)) for _ in range(300)][-1])
    np.testing.assert_allclose(plans[1].tau, plans[0].tau, atol=1e-6)
    assert np.abs(plans[0].tau).max() > 1e-3


# ------------------------------------------------------------------ weighted


@given(seed=st.integers(0, 10_000), levels=st.integers(1, 4))
def test_the_weighted_problem_is_the_sum_of_the_costs(seed: int, levels: int) -> None:
    """H and f of the combined problem are sums over the levels, and its cost is the sum of their costs at
    every U."""
    hierarchy = random_hierarchy(seed, n=5, N=4, levels=levels, even=True)
    one = sum_of_costs(hierarchy.problems)
    H, f = quadratic(one)
    parts = [quadratic(problem) for problem in hierarchy.problems]
    np.testing.assert_allclose(H, sum(part[0] for part in parts), rtol=1e-12, atol=1e-9 * np.abs(H).max())
    np.testing.assert_allclose(f, sum(part[1] for part in parts), rtol=1e-12, atol=1e-9 * np.abs(f).max())
    U = np.random.default_rng(seed).normal(size=(4, 5))
    assert one.cost(U) == pytest.approx(sum(problem.cost(U) for problem in hierarchy.problems))


@given(seed=st.integers(0, 10_000))
def test_a_level_with_a_horizon_of_its_own_sees_no_further(seed: int) -> None:
    """In the combined problem, the residual of a level beyond its own horizon has no effect, in the
    kernel and in the printed equations."""
    hierarchy = random_hierarchy(seed, n=5, N=4, levels=2, even=True)
    first, second = hierarchy.problems
    short = second._replace(knots=2)
    one = sum_of_costs([first, short])
    wild = short._replace(free=np.vstack([short.free[:2], short.free[2:] + 1e3]))
    other = sum_of_costs([first, wild])
    for left, right in zip(quadratic(one), quadratic(other), strict=True):
        np.testing.assert_array_equal(left, right)
    np.testing.assert_array_equal(one.free, other.free)
    H, f = quadratic(one)
    expected = -np.linalg.solve(H, f).reshape(4, 5)
    free_rows = replace(hierarchy, problems=[one], rows=hierarchy.rows.widened(np.full((8, 5), np.inf)))
    for by in ("compiled", "printed"):
        np.testing.assert_allclose(free_rows.solve(by)[0].U, expected, atol=1e-6)


def test_under_weights_the_order_of_the_levels_is_nothing(iiwa: Robot) -> None:
    settings, previews = iiwa_settings(iiwa), moved(iiwa, 5)
    plans = [
        first_plan(Weighted(iiwa, replace(settings, stack=stack)), previews)
        for stack in (settings.stack, settings.stack[::-1])
    ]
    np.testing.assert_allclose(plans[0].tau, plans[1].tau, atol=1e-9)


def test_the_weighted_evidence_is_that_of_the_levels_above_alone(iiwa: Robot) -> None:
    """Entry p equals the result of this controller with the levels below p disabled; the documented leak
    assumes this."""
    settings, previews = iiwa_settings(iiwa), moved(iiwa, 5)
    plan = first_plan(Weighted(iiwa, settings), previews)
    for levels in (1, 2, 3):
        expected = first_plan(Weighted(iiwa, alone(settings, levels)), previews)
        np.testing.assert_allclose(plan.levels[levels - 1].U, expected.levels[-1].U, atol=1e-9)
    assert plan.leak is not None
    assert plan.leak > 1e-2
    strict = first_plan(HIMPC(iiwa, settings), previews)
    assert strict.leak is not None
    assert strict.leak < 1e-9


def test_a_heavier_level_comes_closer_to_a_strict_one(iiwa: Robot) -> None:
    """When the Q of level 1 grows, its cost under the common increments approaches its optimum."""
    previews, excess = moved(iiwa, 5), []
    for factor in (1.0, 1e2, 1e4):
        settings = iiwa_settings(iiwa)
        first: Level = replace(settings.stack[0], Q=200.0 * factor)
        settings = replace(settings, stack=(first, *settings.stack[1:]))
        strict, weighted = (first_plan(kind(iiwa, settings), previews) for kind in (HIMPC, Weighted))
        excess.append((weighted.levels[0].cost - strict.levels[0].cost) / strict.levels[0].cost)
    assert excess[0] > 4 * excess[1] > 16 * excess[2] > 0
