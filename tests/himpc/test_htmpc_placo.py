"""placo at velocity level: its strict level, its weights, and what happens if it finds no solution."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from htmpc_problems import FREE, at_home, closed_loop, mobile_settings, point, previews

from himpc import FrameOrientation, FramePosition, Joints, Level
from himpc.htmpc import HTMPCSettings, Placo
from himpc.references import Hold
from himpc.stack import Stack
from himpc.tasks import CentreOfMass, Posture
from robots import CATALOG, InputError, Robot, load_robot

Array = np.ndarray
FIRST, SECOND = np.array([0.5, 0.1, 0.5]), np.array([0.5, -0.3, 0.5])
"""Goals of two position tasks of the same point, 40 cm apart."""


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("ridgeback-ur10")


@pytest.fixture(scope="module")
def arm() -> Robot:
    return load_robot("iiwa14")


def settings_of(*tasks: Any, **changes: Any) -> HTMPCSettings:
    stack: Stack = tuple(Level((task,), Q=10.0) for task in tasks)
    return replace(HTMPCSettings(stack), **{"rate_hz": 50.0, **changes})


def test_the_first_step_by_hand(robot: Robot) -> None:
    """Far from all bounds the velocity satisfies the first level's equation, and minimises the rest in its
    null space: 10 T²‖q̇_base − ẋ‖² + ρ T²‖q̇‖²."""
    settings = mobile_settings(rate_hz=50.0, limits=FREE, first_level="hard")
    near = np.array([-0.3, 0.4])
    references = {"ee": Hold(point(robot, robot.home) + np.array([0.05, 0.02, 0.0])), "base": Hold(near)}
    plan = Placo(robot, settings).step(robot.home, np.zeros(9), previews(references, 0.0, settings))
    data, frame = robot.model.createData(), robot.frame_id(robot.tip)
    J = pin.computeFrameJacobian(robot.model, data, robot.home, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
    goal = 0.5 * np.array([0.05, 0.02, 0.0])
    first = J.T @ np.linalg.solve(J @ J.T, goal)
    Z = np.linalg.svd(J)[2][3:].T
    H = np.diag([10.0, 10.0, *[0.0] * 7]) + 0.01 * np.eye(9)
    g = np.r_[10.0 * 0.3 * near, np.zeros(7)]
    expected = first + Z @ np.linalg.solve(Z.T @ H @ Z, Z.T @ (g - H @ first))
    np.testing.assert_allclose(plan.command, expected, atol=1e-6)
    assert plan.notice is None and plan.levels[0].name == "ee"
    np.testing.assert_allclose(plan.levels[0].final, 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("first_level", "least", "most"), [("hard", 0.0, 1e-3), ("scaled", 0.0, 1e-3), ("soft", 150.0, 250.0)]
)
def test_of_two_tasks_that_contradict_each_other(
    arm: Robot, first_level: str, least: float, most: float
) -> None:
    """A strict first level arrives, and is held to 1 µm; a level that is weighed meets the other half-way.
    Without limits `hard`, too, can do what is asked."""
    tasks = FramePosition(name="first"), FramePosition(name="second")
    settings = settings_of(*tasks, first_level=first_level, gains=(5.0,), limits=FREE)
    references = {"first": Hold(FIRST), "second": Hold(SECOND)}
    plans, path = closed_loop(Placo(arm, settings), references, arm.home, 6.0)
    assert least <= 1e3 * np.linalg.norm(point(arm, path[-1]) - FIRST) <= most
    assert {plan.notice for plan in plans} == {None}


def test_a_scaled_level_stays_on_its_line_within_all_limits(arm: Robot) -> None:
    """With its limits the arm cannot jump to the speed that is asked: `scaled` is slower, in the same
    direction."""
    settings = settings_of(FramePosition(name="hand"), gains=(5.0,), rate_hz=200.0)
    start = point(arm, arm.home)
    way = np.array([0.1, 0.2, 0.1])
    plans, path = closed_loop(Placo(arm, settings), {"hand": Hold(start + way)}, arm.home, 4.0)
    along = way / np.linalg.norm(way)
    aside = [moved - (moved @ along) * along for moved in (point(arm, q) - start for q in path)]
    assert np.abs(aside).max() < 1e-3
    assert np.linalg.norm(point(arm, path[-1]) - start - way) < 1e-3
    assert all((np.abs(plan.u[0]) <= arm.a_max * (1 + 1e-9)).all() for plan in plans)
    assert np.abs(plans[0].u[0] / arm.a_max).max() == pytest.approx(1.0)


def test_what_placo_refuses_is_said_and_the_robot_brakes(arm: Robot) -> None:
    """A hard level whose goal is out of reach makes placo raise. The moving robot brakes within its limits,
    the plan has placo's sentence, and with a goal near by the robot moves again."""
    settings = settings_of(FramePosition(name="hand"), first_level="hard", gains=(2.0,))
    controller, near = Placo(arm, settings), point(arm, arm.home) + np.array([0.0, 0.004, 0.0])
    q, v = arm.home, np.zeros(7)

    def tick(goal: Array) -> Any:
        nonlocal q, v
        plan = controller.step(q, v, previews({"hand": Hold(goal)}, 0.0, settings))
        q, v = plan.motion.position(0.02), plan.command
        return plan

    moving = [tick(near) for _ in range(5)][-1]
    assert moving.notice is None and np.abs(moving.command).max() > 1e-4
    held = [tick(np.array([3.0, 0.1, 0.5])) for _ in range(40)]
    for plan in held:
        assert "placo found no velocity, and the robot brakes: Problem: Infeasible QP" in plan.notice
        assert plan.notice.endswith("first_level=scaled slows level 1 down instead.")
        assert plan.levels[0].fallback == "keep" and plan.unsolved == 1
        assert (np.abs(plan.u[0]) <= arm.a_max * (1 + 1e-9)).all()
    assert np.abs(held[-1].command).max() == 0.0
    after = [tick(near) for _ in range(100)][-1]
    assert after.notice is None and np.linalg.norm(point(arm, q) - near) < 1e-3


def test_orientation_and_joints_are_tasks_too(arm: Robot) -> None:
    """The orientation is strict, on three axes or on two, and a joint has its value in addition."""
    turned = pin.exp3(np.array([0.2, -0.1, 0.1])) @ placed(arm, arm.home).rotation
    for axes in ("xyz", "xy"):
        tasks = FrameOrientation(name="upright", axes=axes), Joints(name="elbow", joints=("joint_4",))
        references = {"upright": Hold(turned), "elbow": Hold(np.array([-1.2]))}
        plans, path = closed_loop(Placo(arm, settings_of(*tasks, gains=(3.0,))), references, arm.home, 4.0)
        assert np.abs(plans[-1].errors["upright"]).max() < 1e-4
        assert abs(path[-1][3] + 1.2) < 1e-3
        off = pin.log3(placed(arm, path[-1]).rotation @ turned.T)
        assert (np.abs(off) < 1e-4).all() == (axes == "xyz")


def placed(robot: Robot, q: Array) -> pin.SE3:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.frame_id(robot.tip)]


@pytest.mark.parametrize("name", CATALOG)
def test_placo_reads_every_robot_as_we_do(name: str) -> None:
    """A hand that is asked to move by some millimetres moves there, with the joints in our order."""
    robot = load_robot(name)
    tasks = (
        FramePosition(name="hand", axes="xy" if name.startswith("planar") else "xyz"),
        Posture(name="rest"),
    )
    settings = settings_of(*tasks, limits=FREE, gains=(40.0,))
    start = point(robot, robot.home)
    goal = start + np.array([-0.003, 0.002, 0.0])
    references = {"hand": Hold(goal[: len(tasks[0].axes)]), "rest": Hold(robot.home)}
    _, path = closed_loop(Placo(robot, settings), references, robot.home, 0.4)
    np.testing.assert_allclose(point(robot, path[-1]), goal, atol=1e-4)


@pytest.mark.parametrize(
    ("task", "changes", "says"),
    [
        (CentreOfMass(name="balance"), {}, "placo has no task like 'balance' here: it takes positions"),
        (FrameOrientation(name="yaw", axes="z"), {}, "no task like 'yaw'.*orientations on two or three axes"),
        (FramePosition(name="hand"), {"solver": "proxqp"}, "placo has its own QP solver; set solver=daqp"),
    ],
)
def test_what_it_cannot_do_is_refused(arm: Robot, task: Any, changes: Any, says: str) -> None:
    with pytest.raises(InputError, match=says):
        Placo(arm, settings_of(task, **changes))
    controller = Placo(arm, settings_of(FramePosition(name="hand")))
    with pytest.raises(InputError, match=says):
        controller.configure(settings_of(task, **changes))
    plan = controller.step(arm.home, np.zeros(7), previews({"hand": Hold(FIRST)}, 0.0, controller.settings))
    assert plan.notice is None and [level.name for level in plan.levels] == ["hand"]


def test_a_list_of_weights_is_refused(arm: Robot) -> None:
    stack = (Level((FramePosition(name="hand"),), Q=(1.0, 2.0, 3.0)),)
    with pytest.raises(InputError, match="Q of level 'hand' is a list: placo weighs a level by one number"):
        Placo(arm, HTMPCSettings(stack))


def test_controllers_of_one_robot_do_not_disturb_each_other(robot: Robot) -> None:
    """Two controllers share placo's robot, as a robot and its ghost do: each moves as if it were alone."""
    settings = mobile_settings(rate_hz=50.0)
    goals = [at_home(robot, base) for base in (np.array([-0.3, 0.4]), np.array([0.6, 0.0]))]
    alone = [closed_loop(Placo(robot, settings), goal, robot.home, 0.5)[1] for goal in goals]
    states = [(robot.home, np.zeros(9)) for _ in goals]
    both = [Placo(robot, settings), Placo(load_robot("ridgeback-ur10"), settings)]
    for tick in range(25):
        for place, controller in enumerate(both):
            np.testing.assert_array_equal(states[place][0], alone[place][tick])
            plan = controller.step(*states[place], previews(goals[place], 0.0, settings))
            states[place] = plan.motion.position(0.02), plan.motion.velocity(0.02)
