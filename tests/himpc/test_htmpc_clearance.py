"""Closed-form clearances agree with values by hand, finite differences and a collision library."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from clearance_oracle import Oracle
from htmpc_problems import point
from hypothesis import given, settings
from hypothesis import strategies as st

from himpc.htmpc.clearance import CollisionModel
from himpc.htmpc.kinematics import frame_at, geometry, placed
from robots import CATALOG, Robot, load_robot
from robots.collision import Ball, Box, Floor, covering_spheres

Array = np.ndarray


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("ridgeback-ur10")


OBSTACLES = (
    Ball("ball", (1.6, 0.9, 0.8), 0.2),
    Box("box", (1.9, -0.6, 0.4), (0.4, 0.5, 0.8), 0.4),
    Floor("floor"),
)


def test_gradients_of_the_distances(robot: Robot) -> None:
    model = CollisionModel(robot, OBSTACLES, self_collision=True)
    rng = np.random.default_rng(3)
    h, compared = 1e-6, 0
    for _ in range(3):
        q = robot.home + rng.normal(0, 0.2, 9)
        at = model.clearances(q[None], 3.0)
        assert {name for _, name in at.pairs} == {"ball", "box", "floor", "base"}
        for joint in range(9):
            e = h * np.eye(9)[joint]
            ahead, behind = (model.clearances((q + side * e)[None], 3.0).distance for side in (1, -1))
            np.testing.assert_allclose(at.gradient[:, joint], (ahead - behind) / (2 * h), atol=1e-5)
            compared += len(ahead)
    assert compared > 500


def test_distances_by_hand(robot: Robot) -> None:
    """The distances of the tool to a ball next to it, to the floor and to a ball around it have the values
    that were computed by hand."""
    at = point(robot, robot.home)
    radius = next(sphere.radius for sphere in covering_spheres(robot) if sphere.link == "tool")
    x, y, z = at
    beside = Ball("beside", (x + 0.5, y, z), 0.1)
    around = Ball("around", (x, y, z + 0.01), 0.3)
    model = CollisionModel(robot, (beside, around, Floor()))
    near = model.clearances(robot.home[None], 10.0)
    tools = {(name, d) for (link, name), d in zip(near.pairs, near.distance, strict=True) if link == "tool"}
    found = {name: min(d for other, d in tools if other == name) for name in ("beside", "around", "floor")}
    assert found["beside"] == pytest.approx(0.4 - radius, abs=1e-6)
    assert found["around"] == pytest.approx(0.01 - 0.3 - radius, abs=1e-6)
    assert found["floor"] == pytest.approx(z - radius, abs=1e-6)


def test_the_base_may_stand_on_the_floor_and_the_arm_may_not_enter_the_base(robot: Robot) -> None:
    floor = CollisionModel(robot, (Floor(),)).clearances(robot.home[None], 10.0)
    assert floor.distance.min() > 0.3
    own = CollisionModel(robot, (), self_collision=True)
    assert own.clearances(robot.home[None], 10.0).distance.min() > 0.1
    folded = robot.home.copy()
    folded[3:] = np.pi / 2, np.radians(-10), np.radians(150), 0.0, np.pi / 2, 0.0
    folded[4] = np.radians(40)
    assert own.clearances(folded[None], 10.0).distance.min() < 0.0


def test_far_pairs_are_left_out(robot: Robot) -> None:
    model = CollisionModel(robot, OBSTACLES)
    full = model.clearances(robot.home[None], 10.0)
    some = model.clearances(robot.home[None], 0.6)
    assert 0 < len(some.distance) < len(full.distance)
    np.testing.assert_allclose(np.sort(some.distance), np.sort(full.distance[full.distance <= 0.6]))


def test_other_robots_are_covered_along_their_links() -> None:
    arm = load_robot("iiwa14")
    spheres = covering_spheres(arm)
    assert len(spheres) > 7
    model = CollisionModel(arm, (Ball("ball", (0.0, 0.0, 3.0), 0.5),))
    assert model.clearances(arm.home[None], 10.0).distance.min() > 0.5


# ------------------------------------------------------------------ comparison with the library


places = st.tuples(*3 * [st.floats(-2.0, 2.0)])
sizes = st.floats(0.02, 1.5)


@settings(max_examples=60)
@given(
    name=st.sampled_from(("ridgeback-ur10", "iiwa14", "panda")),
    seed=st.integers(0, 1000),
    balls=st.lists(st.tuples(places, sizes), max_size=2),
    boxes=st.lists(st.tuples(places, st.tuples(sizes, sizes, sizes), st.floats(-4.0, 4.0)), max_size=3),
    height=st.floats(-1.0, 1.0),
    within=st.floats(0.05, 4.0),
)
def test_clearances_are_those_of_the_collision_library(
    name: str,
    seed: int,
    balls: list[tuple[tuple[float, float, float], float]],
    boxes: list[tuple[tuple[float, float, float], tuple[float, float, float], float]],
    height: float,
    within: float,
) -> None:
    """Distances, signs and pairs agree for separate, touching and deeply penetrating shapes."""
    robot = load_robot(name)
    obstacles = (
        Floor("floor", height),
        *(Ball(f"ball {k}", *ball) for k, ball in enumerate(balls)),
        *(Box(f"box {k}", *box) for k, box in enumerate(boxes)),
    )
    q = robot.home + np.random.default_rng(seed).normal(0.0, 0.7, (4, robot.n))
    model, oracle = (kind(robot, obstacles, self_collision=True) for kind in (CollisionModel, Oracle))
    found, wanted = model.clearances(q, within), oracle.clearances(q, within)
    assert found.pairs == wanted.pairs
    np.testing.assert_array_equal(found.knot, wanted.knot)
    np.testing.assert_allclose(found.distance, wanted.distance, rtol=0, atol=1e-12)
    quick = model.clearances(q, within, gradients=False)
    np.testing.assert_array_equal(quick.distance, found.distance)
    assert quick.gradient.size == 0


# ------------------------------------------------------------------ kinematics


@pytest.mark.parametrize("name", CATALOG)
def test_joints_and_frames_are_those_of_pinocchio(name: str) -> None:
    robot = load_robot(name)
    data = robot.model.createData()
    q = robot.home + np.random.default_rng(3).normal(0.0, 1.0, (20, robot.n))
    where = placed(geometry(robot), q)
    for frame in robot.frames:
        index, found = robot.frame_id(frame), frame_at(robot, where, frame)
        for k, configuration in enumerate(q):
            J = pin.computeFrameJacobian(robot.model, data, configuration, index, pin.LOCAL_WORLD_ALIGNED)
            pin.framesForwardKinematics(robot.model, data, configuration)
            np.testing.assert_allclose(found.J[k], J, atol=1e-12)
            np.testing.assert_allclose(found.R[k], data.oMf[index].rotation, atol=1e-12)
            np.testing.assert_allclose(found.p[k], data.oMf[index].translation, atol=1e-12)
