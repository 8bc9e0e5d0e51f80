"""HTMPC in closed loop: bounds, evidence, determinism, recovery, live changes, reach, and its variants."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from htmpc_problems import at_home, closed_loop, mobile_settings, mobile_stack, point, previews

from himpc import FrameOrientation, FramePosition, Level
from himpc.htmpc import (
    HTIDKC,
    HTMPC,
    HTMPC_WPT,
    STMPC,
    HTMPCSettings,
    MotionLimits,
    VelocityPlan,
)
from himpc.references import Hold, Reference, SquareWave
from robots import InputError, Robot, VelocityPlant, VelocityPlantSettings, load_robot
from robots.collision import Ball, Floor, covering_spheres

Array = np.ndarray
FAR = np.array([-0.6, -0.7])  # out of reach behind the robot
SIDE = np.array([1.1, 2.25])  # out of reach, and far away
NEAR = np.array([-0.3, 0.4])


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("ridgeback-ur10")


def worst_ratios(robot: Robot, plans: list[VelocityPlan], path: Array) -> dict[str, float]:
    """Returns the largest use of each bound by the applied motion; jerk is the change of input per control
    period."""
    limits = plans[0].bounds
    v = np.array([plan.command for plan in plans])
    u = np.array([plan.u[0] for plan in plans])
    change = np.abs(np.diff(np.vstack([np.zeros(robot.n), u]), axis=0))
    bounded = np.isfinite(limits.q_upper)
    lower, upper = limits.q_lower[bounded], limits.q_upper[bounded]
    middle, half = 0.5 * (upper + lower), 0.5 * (upper - lower)
    return {
        "velocity": float((np.abs(v) / limits.v).max()),
        "acceleration": float((np.abs(u) / limits.a).max()),
        "jerk": float((change / (limits.j * plans[0].motion.dt)).max()),
        "position": float((np.abs(path[:, bounded] - middle) / half).max()),
    }


def wave(robot: Robot, peak: Array = SIDE, half_period: float = 4.0) -> dict[str, Reference]:
    base = SquareWave(peak, np.zeros(2), half_period, waves=1)
    return {"ee": Hold(point(robot, robot.home)), "base": base}


def ee_errors(robot: Robot, path: Array) -> Array:
    goal = point(robot, robot.home)
    return np.array([np.linalg.norm(point(robot, q) - goal) for q in path])


def test_the_base_stops_where_the_arm_is_stretched(robot: Robot) -> None:
    """The second level moves as far as the first one permits if its target is unreachable, and arrives at a
    reachable target."""
    reach = 1.863  # m, checked against the geometry in tests/robots
    height_free = np.linalg.norm(FAR - point(robot, robot.home)[:2])
    assert height_free > reach
    plans, path = closed_loop(HTMPC(robot, mobile_settings()), at_home(robot, FAR), robot.home, 9.0)
    assert ee_errors(robot, path).max() < 5e-3
    stretched = np.linalg.norm(point(robot, robot.home)[:2] - path[-1, :2])
    assert reach - 0.05 < stretched < reach + 5e-3
    # The base is at rest on the line towards its goal, as near as the geometry permits.
    assert np.linalg.norm(path[-1, :2] - FAR) < height_free - reach + 0.08
    assert np.abs(plans[-1].v[0, :2]).max() < 0.02
    plans, path = closed_loop(HTMPC(robot, mobile_settings()), at_home(robot, NEAR), robot.home, 6.0)
    assert np.linalg.norm(path[-1, :2] - NEAR) < 0.01
    assert ee_errors(robot, path).max() < 5e-3


def test_swapped_priorities_let_the_base_go(robot: Robot) -> None:
    stack = tuple(reversed(mobile_stack()))
    _, path = closed_loop(HTMPC(robot, mobile_settings(stack=stack)), at_home(robot, FAR), robot.home, 7.0)
    assert np.linalg.norm(path[-1, :2] - FAR) < 0.01
    assert ee_errors(robot, path)[-1] > 0.2


@pytest.mark.parametrize("rate_hz", [10.0, 50.0])
def test_bounds_evidence_and_accuracy_on_a_square_wave(robot: Robot, rate_hz: float) -> None:
    controller = HTMPC(robot, mobile_settings(rate_hz=rate_hz))
    plans, path = closed_loop(controller, wave(robot), robot.home, 8.0)
    ratios = worst_ratios(robot, plans, path)
    for kind in ("velocity", "acceleration", "jerk", "position"):
        assert ratios[kind] <= 1.001, kind
    assert ratios["velocity"] > 0.9
    assert sum(plan.unsolved for plan in plans) == 0
    assert max(plan.kkt_residual for plan in plans) <= 1e-6
    errors = ee_errors(robot, path)
    assert errors.mean() < (1e-3 if rate_hz == 10.0 else 2e-3)
    assert errors.max() < 1e-2
    assert np.linalg.norm(path[-1, :2]) < 0.05 * np.linalg.norm(SIDE)
    for plan in plans:
        assert plan.leak is not None
        assert plan.leak <= controller.settings.delta_m + 1e-9
        assert [level.name for level in plan.levels] == ["ee", "base"]
        assert all(0.0 <= step <= 1.0 for level in plan.levels for step in level.steps)
    assert {each.kind for plan in plans for each in plan.binding(robot.joint_names)} >= {
        "velocity",
        "jerk",
        "lexicographic",
    }
    bindings = [each for plan in plans for each in plan.binding(robot.joint_names)]
    bound = [each for each in bindings if each.kind == "lexicographic"]
    assert {each.level for each in bound} == {"base"}
    assert {each.joint for each in bound} == {"ee x", "ee y", "ee z"}


def test_the_plan_says_what_will_happen(robot: Robot) -> None:
    controller = HTMPC(robot, mobile_settings())
    references = at_home(robot, NEAR)
    plan = controller.step(robot.home, np.zeros(9), previews(references, 0.0, controller.settings))
    assert plan.q.shape == plan.v.shape == (11, 9)
    np.testing.assert_allclose(plan.command, plan.v[1], atol=1e-12)
    np.testing.assert_allclose(plan.motion.position(0.7), plan.q[7], atol=1e-12)
    np.testing.assert_allclose(plan.errors["base"], -NEAR, atol=1e-12)
    np.testing.assert_allclose(plan.values["ee"], point(robot, robot.home), atol=1e-12)
    tool = np.array([point(robot, q) - point(robot, robot.home) for q in plan.q[1:]])
    np.testing.assert_allclose(plan.levels[0].final, tool, atol=1e-12)


def test_same_input_same_output(robot: Robot) -> None:
    runs = [closed_loop(HTMPC(robot, mobile_settings()), wave(robot), robot.home, 2.0)[1] for _ in range(2)]
    np.testing.assert_array_equal(runs[0], runs[1])
    controller = HTMPC(robot, mobile_settings())
    closed_loop(controller, wave(robot), robot.home, 1.0)
    controller.reset()
    np.testing.assert_array_equal(closed_loop(controller, wave(robot), robot.home, 2.0)[1], runs[0])


def test_formulation_of_the_paper_and_cost_constraint_run(robot: Robot) -> None:
    """With softened bounds the motion stays near its bounds and the command inside them; (11) keeps the cost
    within its δ_J."""
    for changes, least in (
        ({"formulation": "paper", "stack": mobile_stack(1.0)}, 0.3),
        ({"lexicographic": "cost"}, 0.1),
    ):
        controller = HTMPC(robot, mobile_settings(**changes))
        plans, path = closed_loop(controller, wave(robot, half_period=3.0), robot.home, 6.0)
        ratios = worst_ratios(robot, plans, path)
        assert ratios["velocity"] <= 1.001
        assert ratios["acceleration"] <= 1.001
        assert ee_errors(robot, path).max() < 0.15
        assert np.linalg.norm(path[:, :2], axis=1).max() > least
        assert max(plan.kkt_residual for plan in plans) <= 1e-6


# ------------------------------------------------------------------ invalid and extreme input


def test_a_start_outside_every_bound_recovers(robot: Robot) -> None:
    q = robot.home.copy()
    q[3] = robot.q_upper[3] + 0.05
    v = np.array([1.5, -1.3, 0.0, 0.5, 0.0, 0.0, 3.5, 0.0, 0.0])
    controller = HTMPC(robot, mobile_settings())
    references = at_home(robot, np.zeros(2))
    for tick in range(60):
        plan = controller.step(q, v, previews(references, 0.1 * tick, controller.settings))
        q, v = plan.motion.position(0.1), plan.motion.velocity(0.1)
        assert np.isfinite(plan.u).all()
        if tick > 20:
            assert (np.abs(v) <= robot.v_limit + 1e-9).all()
    assert q[3] < robot.q_upper[3] + 0.02
    assert np.linalg.norm(point(robot, q) - point(robot, robot.home)) < 0.01


def test_limits_tightened_while_moving_are_reached_by_braking(robot: Robot) -> None:
    controller = HTMPC(robot, mobile_settings())
    slow = replace(controller.settings, limits=MotionLimits(velocity_scale=0.3))

    def tighten(tick: int) -> None:
        if tick == 15:
            controller.configure(slow)

    plans, _ = closed_loop(controller, at_home(robot, SIDE), robot.home, 4.0, tighten)
    speed = np.array([np.abs(plan.v[0, :2]).max() for plan in plans])
    assert speed[15] > 0.8
    assert speed[26:].max() <= 0.33 + 1e-9
    change = np.abs(np.diff([plan.u[0] for plan in plans], axis=0))
    assert (change[:, :2] <= 1.0 + 1e-9).all()


def test_every_setting_changes_live_without_a_jump(robot: Robot) -> None:
    """After every change velocities are continuous and accelerations inside their bounds."""
    first = mobile_settings()
    order = (
        replace(first, horizon=14),
        replace(first, dt=0.06),
        replace(first, rate_hz=25.0),
        replace(first, formulation="paper"),
        replace(first, lexicographic="cost"),
        replace(first, stack=tuple(reversed(first.stack))),
        replace(first, stack=(first.stack[0], replace(first.stack[1], enabled=False))),
        replace(first, delta_m=1e-3, terminal=3.0, input_effort=0.2),
        replace(first, stack=tuple(replace(level, enabled=False) for level in first.stack)),
        first,
    )
    controller = HTMPC(robot, first)
    q, v, t = robot.home.copy(), np.zeros(9), 0.0
    references = at_home(robot, FAR)
    for settings in order:
        controller.configure(settings)
        for _ in range(6):
            plan = controller.step(q, v, previews(references, t, settings))
            period = settings.period
            assert np.abs(plan.command - v).max() <= (robot.a_max * period + 1e-9).max()
            assert (np.abs(plan.u[0]) <= robot.a_max + 1e-9).all()
            q, v, t = plan.motion.position(period), plan.motion.velocity(period), t + period


def test_a_wrong_setting_changes_nothing(robot: Robot) -> None:
    controller = HTMPC(robot, mobile_settings())
    twin = HTMPC(robot, mobile_settings())
    wrong = Level((FramePosition(name="elbow", frame="elbo"),))
    with pytest.raises(InputError, match="elbo"):
        controller.configure(mobile_settings(stack=(*mobile_stack(), wrong)))
    with pytest.raises(InputError, match="wrist_9"):
        controller.configure(mobile_settings(hold=("wrist_9",)))
    assert controller.settings == twin.settings
    references = at_home(robot, NEAR)
    one, other = (
        each.step(robot.home, np.zeros(9), previews(references, 0.0, twin.settings)).u
        for each in (controller, twin)
    )
    np.testing.assert_array_equal(one, other)


def test_a_state_that_is_not_finite_brakes_along_the_last_plan(robot: Robot) -> None:
    controller = HTMPC(robot, mobile_settings())
    references = at_home(robot, NEAR)
    _, path = closed_loop(controller, references, robot.home, 1.0)
    plan = controller.step(np.full(9, np.nan), np.zeros(9), previews(references, 1.0, controller.settings))
    assert np.isfinite(plan.u).all()
    assert np.isfinite(plan.command).all()
    np.testing.assert_allclose(plan.q[0], path[-1], atol=0.3)


def test_a_reference_that_is_not_finite_makes_it_brake(robot: Robot) -> None:
    controller = HTMPC(robot, mobile_settings())
    plans, path = closed_loop(controller, at_home(robot, SIDE), robot.home, 1.5)
    q, v = plans[-1].motion.position(0.1), plans[-1].command
    assert np.abs(v[:2]).max() > 0.5
    broken = {"ee": Hold(np.full(3, np.nan)), "base": Hold(SIDE)}
    for _ in range(15):
        plan = controller.step(q, v, previews(broken, 0.0, controller.settings))
        assert plan.levels[0].fallback == "keep"
        assert plan.unsolved > 0
        q, v = plan.motion.position(0.1), plan.command
    assert np.abs(v).max() < 0.05
    assert np.linalg.norm(q[:2] - path[-1, :2]) < 1.0


def test_noise_and_wild_states_never_break_it(robot: Robot) -> None:
    """With centimetres of noise, and with states far outside every bound, plans are finite and points
    verified."""
    controller = HTMPC(robot, mobile_settings(obstacles=(Ball("ball", (1.0, 1.0, 0.8), 0.2),)))
    rng = np.random.default_rng(5)
    references = at_home(robot, SIDE)
    q, v = robot.home.copy(), np.zeros(9)
    for tick in range(60):
        scale = 0.01 if tick < 40 else 3.0
        seen = q + scale * rng.normal(size=9), v + scale * rng.normal(size=9)
        plan = controller.step(*seen, previews(references, 0.1 * tick, controller.settings))
        assert np.isfinite(plan.u).all()
        assert plan.kkt_residual <= 1e-6
        assert all(level.fallback in ("solve", "widened", "keep") for level in plan.levels)
        q, v = plan.motion.position(0.1), plan.motion.velocity(0.1)
        if tick < 40:
            assert (np.abs(plan.u[0]) <= robot.a_max + 1e-6).all()


# ------------------------------------------------------------------ collisions


def test_an_obstacle_in_the_way_is_not_entered(robot: Robot) -> None:
    """The base passes a ball that appears in front of it at full speed, without touching it; the bounds that
    are active say which link passes what."""
    ball = Ball("ball", (2.2, 0.0, 0.3), 0.2)
    goal = {
        "ee": Hold(point(robot, robot.home) + np.array([1.2, 0.0, 0.0])),
        "base": Hold(np.array([2.2, 0.0])),
    }
    controller = HTMPC(robot, mobile_settings(margin_m=0.05))

    def appear(tick: int) -> None:
        if tick == 8:
            controller.configure(mobile_settings(margin_m=0.05, obstacles=(ball, Floor())))

    plans, path = closed_loop(controller, goal, robot.home, 7.0, appear)
    assert max(abs(plan.v[0, 0]) for plan in plans[:9]) > 0.8
    nearest = min(plan.clearance for plan in plans[9:])
    assert nearest > 0.04
    assert nearest < 0.2
    assert sum(plan.unsolved for plan in plans) == 0
    assert worst_ratios(robot, plans, path)["velocity"] <= 1.001
    passed = {
        each.joint for plan in plans for each in plan.binding(robot.joint_names) if each.kind == "collision"
    }
    links = {sphere.link for sphere in covering_spheres(robot)}
    assert passed
    assert passed <= {f"{link} – {name}" for link in links for name in ("ball", "floor")}


def test_a_start_inside_the_margin_recovers(robot: Robot) -> None:
    x, y, z = point(robot, robot.home)
    ball = Ball("ball", (x + 0.13, y, z), 0.1)  # 2 cm inside the tool's sphere
    controller = HTMPC(robot, mobile_settings(obstacles=(ball,), margin_m=0.05))
    plans, _ = closed_loop(controller, at_home(robot, np.zeros(2)), robot.home, 4.0)
    assert plans[0].clearance < 0.0
    assert plans[-1].clearance > 0.045
    assert sum(plan.unsolved for plan in plans) == 0


def test_the_arm_keeps_clear_of_its_base(robot: Robot) -> None:
    inside = {"ee": Hold(np.array([0.1, 0.0, 0.3])), "base": Hold(np.zeros(2))}
    kept, free = (
        closed_loop(HTMPC(robot, mobile_settings(self_collision=on, margin_m=0.03)), inside, robot.home, 5.0)
        for on in (True, False)
    )
    watch = HTMPC(robot, mobile_settings(self_collision=True, margin_m=0.03))
    last = watch.step(free[1][-1], np.zeros(9), previews(inside, 0.0, watch.settings))
    assert last.clearance < 0.0
    assert min(plan.clearance for plan in kept[0]) > 0.02


# ------------------------------------------------------------------ delay


def test_delay_compensation_pays(robot: Robot) -> None:
    """With 50 ms of lag in the servos and measurement noise, compensation makes the tool's error much
    smaller."""
    plant_settings = VelocityPlantSettings(mode="ideal", lag_ms=50.0, position_noise=1e-3)
    found = {}
    for delay in (0.0, 0.05):
        plant = VelocityPlant(robot, plant_settings, seed=1)
        controller = HTMPC(robot, mobile_settings(delay_s=delay))
        references, errors = wave(robot, half_period=3.0), []
        for tick in range(60):
            state = plant.measure()
            plan = controller.step(state.q, state.v, previews(references, 0.1 * tick, controller.settings))
            for k in range(10):
                plant.step(plan.motion.velocity(0.01 * (k + 1)), 0.01)
                errors.append(np.linalg.norm(point(robot, plant.q) - point(robot, robot.home)))
        found[delay] = float(np.mean(errors))
    assert found[0.05] < 5e-3
    assert found[0.05] < 0.6 * found[0.0]


# ------------------------------------------------------------------ fixed-base arms


@pytest.mark.parametrize("name", ["iiwa14", "panda"])
def test_fixed_arms_position_then_orientation(name: str) -> None:
    """A 0.3 m step of the target settles below 1 mm. Velocities, accelerations and positions stay within
    their bounds."""
    arm = load_robot(name)
    stack = (
        Level((FramePosition(name="position"),), Q=10.0),
        Level((FrameOrientation(name="orientation"),), Q=10.0),
    )
    controller = HTMPC(arm, HTMPCSettings(stack, rate_hz=20.0))
    data = arm.model.createData()
    pin.framesForwardKinematics(arm.model, data, arm.home)
    R = data.oMf[arm.frame_id(arm.tip)].rotation.copy()
    goal = point(arm, arm.home) + np.array([0.0, 0.3, 0.0])
    references = {"position": Hold(goal), "orientation": Hold(R, m=3)}
    plans, path = closed_loop(controller, references, arm.home, 5.0)
    assert np.linalg.norm(point(arm, path[-1]) - goal) < 1e-3
    assert np.abs(plans[-1].errors["orientation"]).max() < 0.01
    ratios = worst_ratios(arm, plans, path)
    assert max(ratios[kind] for kind in ("velocity", "acceleration", "position")) <= 1.001
    assert sum(plan.unsolved for plan in plans) == 0


# ------------------------------------------------------------------ variants


def test_without_preview_the_switch_comes_as_a_surprise(robot: Robot) -> None:
    """HTMPC_WPT does not move before the switch; HTMPC has started by then."""
    moved = []
    for kind in (HTMPC, HTMPC_WPT):
        controller = kind(robot, mobile_settings())
        _, path = closed_loop(controller, wave(robot, np.array([0.3, 0.2]), 4.0), robot.home, 4.1)
        moved.append(float(np.linalg.norm(path[-1, :2] - [0.3, 0.2])))
    assert moved[0] > 0.1
    assert moved[1] < 0.02


def test_single_task_ignores_lower_levels(robot: Robot) -> None:
    controller = STMPC(robot, mobile_settings())
    references = at_home(robot, FAR)
    plan = controller.step(robot.home, np.zeros(9), previews(references, 0.0, controller.settings))
    assert [level.name for level in plan.levels] == ["ee"]
    assert np.abs(plan.u).max() < 1e-6


def test_htidkc_keeps_its_order_and_bounds(robot: Robot) -> None:
    """Near the singularity its first level may drift because of regularisation, but its QPs keep their
    order."""
    settings = mobile_settings(rate_hz=50.0, horizon=1, dt=0.02)
    plans, path = closed_loop(HTIDKC(robot, settings), at_home(robot, FAR), robot.home, 6.0)
    ratios = worst_ratios(robot, plans, path)
    assert ratios["velocity"] <= 1.001
    assert ratios["acceleration"] <= 1.001
    assert ratios["position"] <= 1.001
    assert max(plan.kkt_residual for plan in plans) <= 1e-6
    assert sum(plan.unsolved for plan in plans) == 0
    assert ee_errors(robot, path).max() < 0.03
    assert np.linalg.norm(path[-1, :2]) > 0.3


def test_htidkc_first_step_by_hand(robot: Robot) -> None:
    """Far from all bounds level 1 is the damped least-squares velocity; level 2 moves in its null space."""
    free = MotionLimits(position=False, velocity=False, acceleration=False, jerk=False)
    settings = mobile_settings(rate_hz=50.0, limits=free)
    references = {"ee": Hold(point(robot, robot.home) + np.array([0.05, 0.02, 0.0])), "base": Hold(NEAR)}
    plan = HTIDKC(robot, settings).step(robot.home, np.zeros(9), previews(references, 0.0, settings))
    J = pin.computeFrameJacobian(
        robot.model,
        robot.model.createData(),
        robot.home,
        robot.frame_id("tool"),
        pin.LOCAL_WORLD_ALIGNED,
    )[:3]
    goal = 0.5 * np.array([0.05, 0.02, 0.0])
    first = J.T @ np.linalg.solve(J @ J.T + 0.01 * np.eye(3), goal)
    np.testing.assert_allclose(J @ plan.command, J @ first, atol=1e-9)
    Z = np.linalg.svd(J)[2][3:].T
    B = np.eye(9)[:2]
    H = Z.T @ (B.T @ B + 0.01 * np.eye(9)) @ Z
    rest = -Z.T @ ((B.T @ B + 0.01 * np.eye(9)) @ first - B.T @ (0.3 * NEAR))
    np.testing.assert_allclose(plan.command, first + Z @ np.linalg.solve(H, rest), atol=1e-8)
