"""The lexicographic optimum of HTMPC with many iterations agrees with Algorithm 1, solved by a general NLP
solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from htmpc_problems import FREE, Oracle, lexicographically_less, mobile_settings, point, previews

from himpc import FramePosition, Joints, Level
from himpc.htmpc import HTMPC, HTMPCSettings
from himpc.references import Hold
from robots import Robot, load_robot

DELTA = 1e-3


@pytest.fixture(scope="module")
def planar() -> Robot:
    return load_robot("planar3")


@pytest.fixture(scope="module")
def mobile() -> Robot:
    return load_robot("ridgeback-ur10")


def converged(settings: HTMPCSettings) -> HTMPCSettings:
    """Returns settings with only (9) and (12), and many iterations. From rest, the proximal effort equals the
    absolute one."""
    return replace(
        settings,
        limits=FREE,
        velocity_effort=0.01,
        input_effort=0.01,
        change_effort=0.0,
        max_iter=100,
        delta_m=DELTA,
    )


def planar_problem(robot: Robot, y: float) -> tuple[HTMPCSettings, Oracle, dict[str, Hold]]:
    """Returns a problem in which level 1 controls x of the tip and level 2 controls y, which is unreachable
    for a large y."""
    stack = (
        Level((FramePosition(name="x", axes="x"),), Q=20.0),
        Level((FramePosition(name="y", axes="y"),), Q=20.0),
    )
    settings = converged(HTMPCSettings(stack, horizon=3, dt=0.2, rate_hz=5.0))
    at = point(robot, robot.home)
    goals = {"x": np.array([at[0] - 0.1]), "y": np.array([y])}
    oracle = Oracle(robot, settings, [("", [0], goals["x"]), ("", [1], goals["y"])])
    return settings, oracle, {name: Hold(goal) for name, goal in goals.items()}


@pytest.mark.parametrize("y", [0.35, 0.55, 0.9])
def test_agrees_with_algorithm_1(planar: Robot, y: float) -> None:
    """Level 1 agrees with the reference. Level 2 is between the references with and without use of the
    tolerance."""
    settings, oracle, references = planar_problem(planar, y)
    plan = HTMPC(planar, settings).step(planar.home, np.zeros(3), previews(references, 0.0, settings))
    start = np.zeros((3, 3))
    strict, loose = oracle.solve(0.0, start), oracle.solve(DELTA, start)
    first = oracle.tracking(0, strict[0])
    assert plan.levels[0].cost == pytest.approx(first, rel=1e-5)
    found = oracle.tracking(1, plan.u.ravel()) + oracle.effort(plan.u.ravel())
    best, worst = (oracle.tracking(1, u[1]) + oracle.effort(u[1]) for u in (loose, strict))
    assert best < worst
    assert best - 1e-6 * worst <= found <= worst * 1.01
    assert plan.leak is not None
    assert plan.leak <= DELTA + 1e-9
    # The order of the levels has an effect: alone, level 2 would increase the error of level 1.
    alone = oracle.solve(10.0, start)[1]
    assert (np.abs(oracle.errors(0, alone)) - np.abs(oracle.errors(0, strict[0]))).max() > 5 * DELTA


def test_no_neighbour_is_lexicographically_less(planar: Robot) -> None:
    """By Definition III.2, applied locally, random neighbours that keep level 1 are no better at level 2."""
    settings, oracle, references = planar_problem(planar, 0.55)
    plan = HTMPC(planar, settings).step(planar.home, np.zeros(3), previews(references, 0.0, settings))

    assert plan.leak is not None
    taken = max(plan.leak, 0.2 * DELTA)

    def costs(u: np.ndarray) -> np.ndarray:
        beyond = np.abs(oracle.errors(0, u)) - np.abs(plan.levels[0].best) - taken
        return np.array([max(0.0, float(beyond.max())), oracle.tracking(1, u) + oracle.effort(u)])

    here = costs(plan.u.ravel())
    tolerance = np.array([0.0, 5e-3 * here[1]])
    assert here[0] == 0.0
    rng, comparable = np.random.default_rng(0), 0
    for radius in (1e-3, 1e-2, 1e-1):
        for _ in range(150):
            there = costs(plan.u.ravel() + radius * rng.normal(size=plan.u.size))
            comparable += there[0] == 0.0
            assert not lexicographically_less(there, here, tolerance)
    assert comparable > 50
    assert lexicographically_less(np.array([1.0, 2.0]), np.array([1.0, 3.0]), np.zeros(2))
    assert not lexicographically_less(np.array([1.1, 0.0]), np.array([1.0, 3.0]), np.zeros(2))


def test_agrees_with_algorithm_1_on_the_mobile_manipulator(mobile: Robot) -> None:
    settings = converged(mobile_settings(horizon=2, dt=0.2, rate_hz=5.0))
    goals = [point(mobile, mobile.home) + np.array([0.02, 0.05, -0.03]), np.array([0.5, 0.3])]
    oracle = Oracle(mobile, settings, [("", [0, 1, 2], goals[0]), ("base", [0, 1], goals[1])])
    references = {"ee": Hold(goals[0]), "base": Hold(goals[1])}
    plan = HTMPC(mobile, settings).step(mobile.home, np.zeros(9), previews(references, 0.0, settings))
    strict, loose = (oracle.solve(delta, np.zeros((2, 9))) for delta in (0.0, DELTA))
    assert plan.levels[0].cost == pytest.approx(oracle.tracking(0, strict[0]), rel=1e-4)
    found = oracle.tracking(1, plan.u.ravel()) + oracle.effort(plan.u.ravel())
    best, worst = (oracle.tracking(1, u[1]) + oracle.effort(u[1]) for u in (loose, strict))
    assert best - 1e-6 * worst <= found <= worst * 1.01


def test_an_unreachable_first_level_is_not_given_up_for_the_second(planar: Robot) -> None:
    """If the target of level 1 is out of reach, its errors are large, but level 2 does not increase them."""
    settings, _, _ = planar_problem(planar, 0.3)
    settings = replace(settings, delta_m=1e-4)
    references = {"x": Hold(np.array([3.0])), "y": Hold(np.array([0.9]))}
    plan = HTMPC(planar, settings).step(planar.home, np.zeros(3), previews(references, 0.0, settings))
    assert np.abs(plan.levels[0].best).min() > 1.0
    assert plan.leak is not None
    assert plan.leak <= 1e-4 + 1e-9


def test_three_levels_keep_their_order() -> None:
    """With three levels, each added level keeps all levels above it within δ."""
    arm = load_robot("panda")
    stack = (
        Level((FramePosition(name="tip"),), Q=10.0),
        Level((FramePosition(name="elbow", frame="link4", axes="z"),), Q=10.0),
        Level((Joints(name="q1", joints=arm.joint_names[:1]),), Q=10.0),
    )
    settings = HTMPCSettings(stack, horizon=5, max_iter=5, delta_m=1e-3)
    elbow = point(arm, arm.home, "link4")[2]
    references = {
        "tip": Hold(point(arm, arm.home) + np.array([0.1, 0.1, 0.0])),
        "elbow": Hold(np.array([elbow + 0.3])),
        "q1": Hold(np.array([0.8])),
    }
    plan = HTMPC(arm, settings).step(arm.home, np.zeros(7), previews(references, 0.0, settings))
    assert [level.name for level in plan.levels] == ["tip", "elbow", "q1"]
    for level in plan.levels[:-1]:
        assert (np.abs(level.final) - np.abs(level.best)).max() <= 1e-3 + 1e-9
    assert abs(plan.levels[2].final[-1, 0]) < 0.8
