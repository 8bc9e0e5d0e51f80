"""The errors of all kinds of tasks are differentiated numerically up to 179°: their derivative is ẋ − ẋ_d,
and the derivative of ẋ_d is ẍ_d."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc.htmpc.kinematics import Knots
from himpc.kinematics.configuration import Configuration
from himpc.references import Preview
from himpc.rotation import exp3
from himpc.tasks import (
    KINDS,
    CentreOfMass,
    Damping,
    FrameOrientation,
    FramePosition,
    Joints,
    OrientationTask,
    PlaneDistance,
    Pointing,
    Posture,
    RelativeOrientation,
    RelativePosition,
    Task,
)
from robots import Robot, load_robot

Array = NDArray[np.float64]
H = 1e-5
SUBSETS = ("xyz", "xy", "yz", "zx", "x", "y", "z")
TURNS = [
    *(FrameOrientation(name=f"turn {axes}", axes=axes) for axes in SUBSETS),
    *(RelativeOrientation(name=f"relative turn {axes}", root="link_2", axes=axes) for axes in SUBSETS),
]
OTHERS = [
    FramePosition(name="position", axes="zx"),
    RelativePosition(name="relative", root="link_2"),
    CentreOfMass(name="com"),
    PlaneDistance(name="plane", normal=(1.0, 2.0, 3.0), offset=0.1),
    Pointing(name="look", frame="link_5", axis="-y"),
    Joints(name="joints", joints=("joint_2",)),
    Posture(name="posture"),
]
TASKS: dict[str, Task] = {task.name: task for task in (*TURNS, *OTHERS)}


@cache
def arm() -> Robot:
    return load_robot("iiwa14")


def test_every_class_is_among_them() -> None:
    """The list contains every class except damping, whose error is always zero."""
    assert {type(task) for task in TASKS.values()} | {Damping} == {
        k for each in KINDS.values() for k in each.makes
    }


class Motion:
    """The motion of a robot and of a target: q = q₀ + vt, and y_d with ẏ_d and ÿ_d in the coordinates of the
    task's target."""

    def __init__(self, task: Task, seed: int, angle: float) -> None:
        """angle: the angle between value and target, or between axis and direction to the point, at t = 0,
        rad."""
        self.task, robot, rng = task, arm(), np.random.default_rng(seed)
        self.data = robot.model.createData()
        self.q, self.v = rng.uniform(-1.5, 1.5, 7), rng.uniform(-1.0, 1.0, 7)
        here = Configuration(robot, self.data, self.q, self.v)
        self.y, size = task.target(here), 3
        if isinstance(task, OrientationTask):
            n = rng.normal(size=3)
            self.y = exp3(-angle * n / np.linalg.norm(n)) @ self.y
        elif isinstance(task, Pointing):
            place, side = here.placement(task.frame), np.array([rng.normal(), 0.0, rng.normal()])
            ahead = np.array([0.0, -1.0, 0.0])
            s = np.cos(angle) * ahead + np.sin(angle) * side / np.linalg.norm(side)
            self.y = place.act(rng.uniform(0.3, 1.0) * s)
        else:
            size = self.y.size
            self.y = self.y + rng.normal(size=size)
        self.y_dot, self.y_ddot = rng.normal(0.0, 0.5, (2, size))

    def target(self, t: float) -> Array:
        gone = t * self.y_dot + 0.5 * t * t * self.y_ddot
        return exp3(gone) @ self.y if self.y.ndim == 2 else self.y + gone

    def at(self, t: float, N: int = 1) -> tuple[Configuration, Preview]:
        """Returns the state and the preview of the next N periods of 1e-3 s."""
        times = 1e-3 * np.arange(N + 1)
        gone = [self.target(t + s) for s in times]
        velocity = self.y_dot + (t + times[:, None]) * self.y_ddot
        acceleration = np.tile(self.y_ddot, (N + 1, 1))
        displacement = times[:, None] * velocity[0] + 0.5 * times[:, None] ** 2 * self.y_ddot
        preview = Preview(gone[0], displacement, velocity, acceleration)
        knots = [self.q + (t + s) * self.v for s in times[1:N]]
        previews = {self.task.name: preview}
        return Configuration(arm(), self.data, self.q + t * self.v, self.v, knots, previews), preview

    def error(self, t: float) -> Array:
        here, preview = self.at(t)
        return self.task.error(self.task.value(here), preview.value)

    def slope(self, t: float) -> Array:
        """Returns ẋ − ẋ_d as controllers compute it."""
        here, preview = self.at(t)
        return (
            self.task.jacobian(here)[0] @ self.v
            - self.task.reference_in_task_coordinates(here, preview).velocity[0]
        )


ANGLES = st.one_of(st.floats(0.0, np.pi), st.just(np.radians(179.0)), st.just(0.0)).map(
    lambda angle: min(angle, np.radians(179.0))
)


@pytest.mark.parametrize("name", TASKS)
@given(seed=st.integers(0, 2**32 - 1), angle=ANGLES)
@settings(max_examples=25)
def test_what_controllers_take_for_its_derivative_is_the_errors_own(
    name: str, seed: int, angle: float
) -> None:
    """d/dt x̃ = ẋ − ẋ_d while robot and target move; for rotations on two or three axes only along x̃."""
    motion = Motion(TASKS[name], seed, angle)
    before, after, slope = motion.error(-H), motion.error(H), motion.slope(0.0)
    moved = (after - before) / (2 * H)
    if isinstance(motion.task, OrientationTask) and len(motion.task.axes) > 1:
        # Close to 180° the direction of a reduced error changes arbitrarily fast, but its length does not.
        moved = (after @ after - before @ before) / (4 * H)
        slope = motion.error(0.0) @ slope
    scale = 1.0 + float(np.abs(slope).max())
    if np.linalg.norm(motion.error(0.0)) > np.radians(179.0) + 1e-9:
        return  # the difference would cross the opposite direction
    np.testing.assert_allclose(moved, slope, atol=2e-5 * scale**3)


@pytest.mark.parametrize("task", [task for task in TURNS if len(task.axes) == 2], ids=lambda task: task.name)
@given(seed=st.integers(0, 2**32 - 1), angle=st.floats(-np.radians(179.0), np.radians(179.0)))
@settings(max_examples=25)
def test_a_free_rotation_does_not_turn_the_error(task: OrientationTask, seed: int, angle: float) -> None:
    """For two controlled axes and x̃ = 0, the derivative of x̃ is ẋ − ẋ_d for every rotation about the third
    axis."""
    motion = Motion(task, seed, 0.0)
    free = np.array([float(axis not in task.axes) for axis in "xyz"])
    motion.y = exp3(angle * free) @ motion.y
    np.testing.assert_allclose(motion.error(0.0), 0.0, atol=1e-12)
    moved = (motion.error(H) - motion.error(-H)) / (2 * H)
    np.testing.assert_allclose(moved, motion.slope(0.0), atol=1e-6)


@pytest.mark.parametrize("name", [*(task.name for task in TURNS if len(task.axes) < 3), "look"])
@given(seed=st.integers(0, 2**32 - 1), angle=st.floats(0.0, 2.8))
@settings(max_examples=15)
def test_accelerations_of_references_are_derivatives_of_their_velocities(
    name: str, seed: int, angle: float
) -> None:
    """ẍ_d = d/dt ẋ_d along the motion of robot and target, and x_d is the integral of ẋ_d over the
    horizon."""
    motion, N = Motion(TASKS[name], seed, angle), 6
    asked = [motion.task.reference_in_task_coordinates(*motion.at(t, N)) for t in (-H, 0.0, H)]
    found = (asked[2].velocity[0] - asked[0].velocity[0]) / (2 * H)
    scale = 1.0 + float(np.abs(asked[1].acceleration).max())
    np.testing.assert_allclose(asked[1].acceleration[0], found, atol=1e-4 * scale**2)
    trapezoid = 0.5e-3 * (asked[1].velocity[1:] + asked[1].velocity[:-1]).cumsum(axis=0)
    np.testing.assert_allclose(asked[1].displacement[1:], trapezoid, atol=2e-5 * scale)
    # The state has one knot less than the reference.
    later = motion.task.reference_in_task_coordinates(*motion.at(1e-3 * (N - 1), 1)).velocity[0]
    np.testing.assert_allclose(asked[1].velocity[N - 1], later, atol=2e-5 * scale)


@pytest.mark.parametrize("axes", SUBSETS)
def test_errors_end_at_180_degrees(axes: str) -> None:
    """At 180°, also with rounding errors, the error is finite and at most π. If the axis of rotation is among
    the controlled axes, the error is π."""
    rng = np.random.default_rng(3)
    task = FrameOrientation(name="turn", axes=axes)
    for noise in (0.0, 1e-15, 1e-12, 1e-9, 1e-6):
        for n in (*np.eye(3), *rng.normal(size=(6, 3))):
            n = n / np.linalg.norm(n)
            E = exp3(np.pi * n) @ exp3(noise * rng.normal(size=3))
            error, slope = task.error(E, np.eye(3)), task.slopes([E], [np.eye(3)])
            assert np.isfinite(error).all()
            assert np.isfinite(slope).all()
            assert np.abs(slope).max() <= np.pi / 2 + 1e-6
            assert np.linalg.norm(error) <= np.pi + 1e-9
            seen = n[task.components]
            if np.linalg.norm(seen) > 1.0 - 1e-12:
                assert np.linalg.norm(error) == pytest.approx(np.pi, abs=2e-5)


@pytest.mark.parametrize("axis", ["x", "y", "z", "-x", "-y", "-z"])
def test_pointing_away_is_180_degrees(axis: str) -> None:
    """If the axis points in the opposite direction or nearly so, the norm of the error is the angle."""
    robot = arm()
    task, data = Pointing(name="look", axis=axis), robot.model.createData()
    here = Configuration(robot, data, robot.home, np.zeros(7))
    place = here.placement()
    back = place.rotation.T @ (place.translation - task.target(here))
    aside = np.roll(back, 1)
    for angle in (0.0, 1e-12, 1e-6, 1e-4, 1e-3, 1e-2):
        point = place.act(np.cos(angle) * back + np.sin(angle) * aside)
        zero = np.zeros((2, 3))
        told = Configuration(
            robot, data, robot.home, np.zeros(7), previews={"look": Preview(point, zero, zero, zero)}
        )
        assert np.linalg.norm(task.value(told)) == pytest.approx(np.pi - angle, abs=1e-9)
        assert np.isfinite(task.jacobian(told)).all()
        assert np.abs(task.jacobian(told)).max() < 1000.0


# ------------------------------------------------------------------ in the closed loop


def test_htmpc_knows_how_an_orientation_on_one_axis_changes() -> None:
    """∂e/∂q at the knots is the derivative of e for every rotation about the other axes."""
    robot, rng = arm(), np.random.default_rng(5)
    task = FrameOrientation(name="turn", axes="z")
    q, goals = rng.uniform(-1.5, 1.5, (3, 7)), [exp3(rng.normal(size=3)) for _ in range(3)]
    J = Knots(robot, robot.model.createData(), q).jacobian(task, goals)
    for joint, nudge in enumerate(H * np.eye(7)):
        after, before = (
            Knots(robot, robot.model.createData(), q + s * nudge).errors(task, goals) for s in (1, -1)
        )
        np.testing.assert_allclose(J[:, :, joint], (after - before) / (2 * H), atol=1e-7)
