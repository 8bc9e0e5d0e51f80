"""At torque level, the computed distances agree with those of a collision library, and the rows keep the
required distances."""

# pyright: reportAttributeAccessIssue=false
# coal is a compiled module without type information.

from __future__ import annotations

import math
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc.constants import MOVING, SLOWEST
from himpc.controllers.stall_guard import StallGuard
from himpc.limits import Limits, in_force
from himpc.limits.constraint import Near
from himpc.limits.distance import least_rates
from himpc.limits.limits import Avoidance
from himpc.references.outlook import Observed
from himpc.tick.distances import Distances
from robots import Robot, load_robot
from robots.collision import Ball, Box, Floor
from robots.covering.cover_of import cover_of
from robots.geometry import Capsule
from robots.world import Post

Array = NDArray[np.float64]

WORLD = (
    Floor(),
    Ball("ball", (0.5, 0.2, 0.5), 0.1),
    Box("box", (-0.4, 0.3, 0.4), (0.3, 0.2, 0.5), 0.7),
    Post("post", (0.3, -0.4, 0.0), 0.8, 0.05),
)
SHAPES = {
    "ball": (coal.Sphere(0.1), (0.5, 0.2, 0.5), 0.0),
    "box": (coal.Box(0.3, 0.2, 0.5), (-0.4, 0.3, 0.4), 0.7),
    "post": (coal.Capsule(0.05, 0.8), (0.3, -0.4, 0.4), 0.0),
}


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("iiwa14")


def placed(robot: Robot, q: np.ndarray, capsule: Capsule) -> tuple[coal.Capsule, coal.Transform3s]:
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    start, end = (data.oMi[capsule.joint].act(np.array(each)) for each in (capsule.start, capsule.end))
    along = end - start
    length = float(np.linalg.norm(along))
    turn = np.eye(3)
    if length:
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length).toRotationMatrix()
    return coal.Capsule(capsule.radius, length), coal.Transform3s(turn, 0.5 * (start + end))


def between(one: tuple, other: tuple) -> float:
    return coal.distance(*one, *other, coal.DistanceRequest(), coal.DistanceResult())


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_distances_are_those_of_the_collision_library(seed: int) -> None:
    """The distances of the chosen pairs (link and object, or two links) are those of the library. The
    reported room is at most the smallest distance to an object."""
    robot = load_robot("iiwa14")
    q = np.random.default_rng(seed).uniform(robot.q_lower, robot.q_upper)
    distances = Distances(robot, Avoidance(on=True))
    near = distances.at(q, Observed(WORLD))
    capsules = cover_of(robot).capsules
    solids = [placed(robot, q, each) for each in capsules]
    things = {
        name: (shape, coal.Transform3s(pin.rpy.rpyToMatrix(0.0, 0.0, yaw), np.array(place)))
        for name, (shape, place, yaw) in SHAPES.items()
    }
    for name, distance in zip(near.names, near.distance.tolist(), strict=True):
        link, other = name.split(" – ")
        mine = [solid for solid, each in zip(solids, capsules, strict=True) if each.link == link]
        if other == "floor":
            heights = [
                float(pose.getTranslation()[2] - abs(pose.getRotation()[2, 2]) * solid.halfLength)
                - solid.radius
                for solid, pose in mine
            ]
            assert min(abs(each - distance) for each in heights) < 1e-6
            continue
        theirs = (
            [things[other]]
            if other in things
            else [solid for solid, each in zip(solids, capsules, strict=True) if each.link == other]
        )
        exact = [between(one, two) for one in mine for two in theirs]
        if distance > 1e-3:  # for penetration the library uses convex solids, and our code uses segments
            assert min(abs(each - distance) for each in exact) < 1e-5
    exact = [between(one, two) for one in solids[2:] for two in things.values()]
    assert distances.room <= max(min(exact), 0.0) - 0.01 + 1e-6
    assert (np.diff(near.distance) >= 0.0).all()


def test_gradients_are_the_derivatives_of_the_distances(robot: Robot) -> None:
    """Between two neighbouring postures the distances change as the gradients predict."""
    rng, h, checked = np.random.default_rng(3), 1e-6, 0
    distances = Distances(robot, Avoidance(on=True))
    for _ in range(20):
        q, step = rng.uniform(robot.q_lower, robot.q_upper), rng.normal(size=robot.n)
        low, near, high = (distances.at(q + k * h * step, Observed(WORLD)) for k in (-1, 0, 1))
        if low.names == near.names == high.names:
            apart = (
                near.distance > 0.0
            )  # inside a box, the nearest point may lie where two faces are equally far
            rate = (high.distance - low.distance) / (2.0 * h)
            assert rate[apart] == pytest.approx((near.gradient @ step)[apart], abs=2e-3)
            checked += int(apart.sum())
    assert checked > 50


def test_pairs_that_meet_soonest_have_the_rows() -> None:
    """Seven pairs of a panda's wrist and elbow are nearer than a ball, but hardly move relative to each
    other. At least five of the seven rows are those of pairs with the ball, whether it moves or not."""
    panda = load_robot("panda")
    q = np.array([-0.11, -0.54, 0.51, -2.27, -0.37, 1.33, 0.63])
    data = panda.model.createData()
    pin.framesForwardKinematics(panda.model, data, q)
    hand = data.oMf[panda.frame_id("hand")].translation
    ball, distances = (
        Ball("ball", tuple((hand + np.array([0.0, 0.0, 0.3])).tolist()), 0.08),
        Distances(panda, Avoidance(on=True)),
    )
    for velocity in (None, np.array([[0.0, 0.0, -0.5]])):
        near = distances.at(q, Observed((ball,), velocity))
        assert sum("ball" in name for name in near.names) >= 5
        assert len(set(near.distance.tolist())) == len(near.distance) == panda.n


def test_an_object_that_comes_closer_must_be_evaded(robot: Robot) -> None:
    """The velocity of the object towards the link is added to the least rate; if the object moves away, its
    velocity is subtracted."""
    ball = Ball("ball", (0.56, 0.0, 0.6), 0.05)
    still, coming, going_away = (
        Distances(robot, Avoidance(on=True)).at(robot.home, Observed((ball,), velocity))
        for velocity in (None, np.array([[0.0, 0.0, -0.5]]), np.array([[0.0, 0.0, 0.5]]))
    )
    place = next(k for k, name in enumerate(still.names) if "ball" in name)
    rates = [least_rates(near, Avoidance(on=True))[place] for near in (still, coming, going_away)]
    assert rates[1] > rates[0] > rates[2]
    assert rates[1] - rates[0] == pytest.approx(rates[0] - rates[2])


def pairs(*distance: float) -> Near:
    r = len(distance)
    return Near(np.array(distance), np.zeros((r, 7)), np.zeros(r), np.ones(r), ("",) * r)


def test_from_the_least_rate_a_stop_is_possible() -> None:
    """When the distance changes at the least rate, reaction and deceleration need exactly the room that is
    left. Inside d_safe the rate is positive. A pair that has just entered the set has no bound yet."""
    kept = Avoidance(on=True, d_safe=0.02, margin=0.01, reaction=0.1, deceleration=1.5)
    far, middle, inside, entering = least_rates(pairs(0.18, 0.05, 0.01, 0.2499999), kept)
    for distance, rate in ((0.18, far), (0.05, middle)):
        stop = -rate * 0.1 + rate**2 / (2.0 * 1.5)
        assert stop == pytest.approx(distance - 0.03)
    assert inside > 0.0
    assert entering < -1e3
    assert least_rates(pairs(0.025), kept) == [0.0]


@dataclass
class Pairs:
    """The fields of `Distances` that a guard reads."""

    carried: np.ndarray
    room: float = math.inf
    moves: bool = False
    moving: float = MOVING
    velocity_margin: float = 0.0


class Guarded:
    """A guard of a robot with two tasks, and the velocity limits that it leaves, as shares of the limits."""

    def __init__(self, robot: Robot, tasks: int = 2) -> None:
        self.limits = in_force(robot, Limits())
        self.guard = StallGuard(tasks, 1e-3)
        self.pairs = Pairs(Distances(robot, Avoidance(on=True)).carried)
        self.still = np.zeros(robot.n)

    def share(self, tau: Array | None = None, v: Array | None = None) -> Array:
        tau, v = (self.still if each is None else each for each in (tau, v))
        slower = self.guard.limits(self.limits, tau, v, self.pairs)  # pyright: ignore[reportArgumentType]
        return slower.v_limit / self.limits.v_limit

    def stall(self, errors: list[float], moves: bool, room: float) -> Array:
        self.pairs.moves, self.pairs.room, self.guard.errors = moves, room, np.array(errors)
        return self.share()


def test_joints_that_a_motor_with_little_torque_left_carries_become_slow(robot: Robot) -> None:
    """Only a motor with a large mean torque lowers the velocity limits of the joints that it carries; a short
    peak of torque does not."""
    now = Guarded(robot)
    tau, share = 0.4 * now.limits.tau_upper, np.ones(robot.n)
    for tick in range(1000):
        tau[1] = -0.75 * now.limits.tau_upper[1]
        tau[2] = now.limits.tau_upper[2] if tick == 990 else 0.0
        share = now.share(tau)
        assert tick or (share == 1.0).all()
    assert share[0] == 1.0
    assert share[1:] == pytest.approx(0.2 / 0.4, rel=1e-3)


def test_a_joint_that_accelerates_towards_its_limit_gets_a_lower_one(robot: Robot) -> None:
    """Only a joint that becomes faster gets a lower limit, at least half of its own limit. A joint that
    brakes keeps its limit."""
    now = Guarded(robot)
    v_limit = now.limits.v_limit
    assert (now.share(v=0.4 * v_limit) == 1.0).all()
    v = 0.8 * v_limit
    v[2] = -v[2]
    now = Guarded(robot)
    share, acceleration = now.share(v=v), np.zeros(robot.n)
    acceleration[:4] = 2.0, -2.0, -2.0, 100.0
    for _ in range(200):
        v = v + 1e-3 * acceleration / 5.0
        share = now.share(v=v)
    lower = 1.0 - 0.1 * 0.4 / v_limit
    assert share[[0, 2]] == pytest.approx(lower[[0, 2]], abs=0.01)
    assert share[3] == pytest.approx(0.5)
    assert share[[1, 4, 5, 6]] == pytest.approx(1.0)


def test_a_robot_without_progress_becomes_slow(robot: Robot) -> None:
    """The joints become slower only if something is near, nothing moves, a task is away from its target, and
    no error decreases."""
    cases = {
        "stalled": (0.3, False, 0.01),
        "a little inside": (0.3, False, -0.012),
        "far from everything": (0.3, False, 0.2),
        "far inside": (0.3, False, -0.04),
        "a target moves": (0.3, True, 0.01),
        "there": (0.005, False, 0.01),
    }
    stalled = pytest.approx(SLOWEST / in_force(robot, Limits()).v_limit, abs=0.01)
    shares = {}
    for name, (error, moves, room) in cases.items():
        now = Guarded(robot)
        shares[name] = [now.stall([error, 0.0], moves, room) for _ in range(2000)][-1]
    assert shares.pop("stalled") == stalled
    assert shares.pop("a little inside") == stalled
    assert all((share == 1.0).all() for share in shares.values())
    now, error, share = Guarded(robot, 1), 0.5, np.zeros(robot.n)
    for _ in range(2000):
        error -= 2e-4
        share = now.stall([error], False, 0.01)
    assert (share == 1.0).all()
    now = Guarded(robot, 1)
    for _ in range(1000):
        share = now.stall([0.3], False, 0.01)
    assert share == stalled
    assert (now.stall([0.35], False, 0.01) > share + 0.01).all()  # it was pushed away and may return
    now = Guarded(robot, 1)
    for error in [*[0.3] * 300, *np.linspace(0.3, 0.2, 100), *[0.2] * 1000]:
        share = now.stall([error], False, 0.01)
    # an error that decreases while the robot brakes does not make it faster again
    assert share == stalled
