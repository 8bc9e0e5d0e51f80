"""Drags robots at random into their surroundings and into themselves, with and without rows that keep
distances.

    python -m benchmarks.avoidance [--chains 25] [--robots iiwa14 panda baxter generated] [--off] [--balls]
                                   [--seed 1] [--controller himpc] [--set PATH=VALUE …]

Every chain drags the hands of a robot four times, once a second, in position alone or in position and
orientation. Each new target is 0.1 to 0.6 m from the present target in a random direction, so that many
targets lie in the floor, in the robot or out of reach. Then the robot has three seconds to come to rest. With
`--balls`, a ball is dragged through the arm four times instead, at 0.15 to 0.5 m/s, from 0.6 m before a
moving link to 0.6 m behind it. The ball does not pass through the first three joints, which cannot move out
of its way. Any controller can run.

The program prints a line of a Markdown table for each robot: the drags; the deepest penetration between
bodies whose distance is kept, by MuJoCo's geometry; the chains in which this penetration exceeds 1 mm; the
largest share of the velocity limits; lost runs; unsolved QPs; the chains whose joints are slower than 0.05
rad/s at the end; and the median and the longest processor time of a step. It prints one line on the error
stream after every chain. The exit code is 1 if a penetration exceeds 1 mm, a run is lost, or more than 5 % of
the chains do not come to rest.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import thread_time_ns
from typing import Any, NamedTuple, cast

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from himpc.controllers.controller import Controller
from himpc.plan import Plan
from lessons.events import MoveTarget
from lessons.scenes.catalog import torque_scene
from lessons.scenes.hold import hold
from lessons.scenes.torque_scene import TorqueScene
from lessons.session.session import LOST_SPEED
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import with_assignments
from robots import Robot
from robots.covering.cover_of import cover_of
from robots.world import Ball, Thing

Array = NDArray[np.float64]

DRAGS, APART_S, REST_S = 4, 1.0, 3.0
FAR_M, TURN_RAD = (0.1, 0.6), 1.0
"""The shortest and the longest distance of a drag, and its largest rotation."""
DEEP_M, AT_REST = 1e-3, 0.05
BALL_M, BESIDE_M, BALL_SPEED = 0.08, 0.6, (0.15, 0.5)
"""Radius of a dragged ball, the length of its path before and behind a link, and its range of speeds, m/s."""
PAST_M, CLEAR_M = 0.25, 0.35
"""The smallest distance, m, between the ball's path and the first three joints of an arm, and between the
start of the path and the whole arm."""
AWAY = np.array([0.0, 0.0, 10.0])
"""The position at which the ball waits, m."""
SCENES = {"iiwa14": "iiwa14-hold", "panda": "panda-hold", "baxter": "baxter-hold"}
ROBOTS = (*SCENES, "generated")


@dataclass
class Total:
    """The results of all chains of one robot."""

    drags: int = 0
    deepest: float = 0.0
    deep: int = 0
    where: str = ""
    speed: float = 0.0
    lost: int = 0
    unsolved: int = 0
    resting: int = 0
    chains: int = 0


def generated(seed: int) -> str:
    """Returns the URDF of a random arm with six joints, whose links are cylinders."""
    rng = np.random.default_rng(seed)
    parts = ['<robot name="generated"><link name="base"/>']
    parent, length = "base", 0.3
    for j in range(6):
        length_next = float(rng.uniform(0.12, 0.3))
        axis = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")[j]
        parts.append(
            f'<joint name="joint_{j + 1}" type="revolute"><parent link="{parent}"/>'
            f'<child link="link_{j + 1}"/><origin xyz="0 0 {length:.3f}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.6" upper="2.6" effort="150" velocity="2.0"/></joint>'
            f'<link name="link_{j + 1}"><inertial><origin xyz="0 0 {length_next / 2:.3f}"/>'
            f'<mass value="{3.0 - 0.4 * j:.2f}"/><inertia ixx="0.03" iyy="0.03" izz="0.01" ixy="0" '
            'ixz="0" iyz="0"/></inertial><collision><origin '
            f'xyz="0 0 {length_next / 2:.3f}"/><geometry><cylinder radius="{0.06 - 0.006 * j:.3f}" '
            f'length="{length_next:.3f}"/></geometry></collision></link>'
        )
        parent, length = f"link_{j + 1}", length_next
    return "".join(parts) + "</robot>"


def scene_of(robot: str, seed: int) -> TorqueScene:
    """Returns the hold scene of a robot of this benchmark."""
    return torque_scene(SCENES[robot]) if robot in SCENES else hold(None, None, generated(seed))


def drags(session: TorqueSession, rng: np.random.Generator) -> list[MoveTarget]:
    """Returns the targets of one drag: every position target moves, and in half of the drags every
    orientation target on three axes turns as well."""
    found, turns = [], rng.random() < 0.5
    for level in session.settings.levels:
        for task in level.tasks:
            target, frame = session.target(task.name), getattr(task, "frame", None)
            if target is None or frame is None:
                continue
            if target.raw.ndim == 1:
                away = rng.normal(size=target.raw.size)
                away *= rng.uniform(*FAR_M) / np.linalg.norm(away)
                found.append(MoveTarget(task.name, tuple((target.raw + away).tolist())))
            elif turns and len(getattr(task, "axes", "xyz")) == 3:
                axis = rng.normal(size=3)
                turn = pin.exp3(rng.uniform(0.0, TURN_RAD) * axis / np.linalg.norm(axis))
                goal = pin.Quaternion(turn @ target.raw).coeffs()
                found.append(MoveTarget(task.name, tuple(goal.tolist())))
    return found


class Crossing(NamedTuple):
    """A ball that is dragged through an arm: its position at the start, m, its velocity, m/s, and the
    duration, s."""

    start: Array
    velocity: Array
    seconds: float


def crossing(session: TorqueSession, rng: np.random.Generator) -> Crossing:
    """Returns a path through the origin of a random joint that moves. The path does not come near the first
    three joints of the arm."""
    robot, data = session.robot, session.robot.model.createData()
    pin.forwardKinematics(robot.model, data, session.plant.q)
    origins = np.array([each.translation for each in data.oMi])
    depth = np.array([len(each) - 1 for each in robot.model.supports])
    points = np.vstack([origins, 0.5 * (origins[1:] + origins[robot.model.parents.tolist()[1:]])])
    while True:
        away = rng.normal(size=3)
        away[2] *= 0.3
        away /= np.linalg.norm(away)
        middle, speed = origins[int(rng.choice(np.flatnonzero(depth > 3)))], rng.uniform(*BALL_SPEED)
        first = origins[depth <= 3] - middle
        along = np.clip(first @ away, -BESIDE_M, BESIDE_M)
        past = np.linalg.norm(first - along[:, None] * away, axis=1).min() > PAST_M
        if past and np.linalg.norm(points - middle - BESIDE_M * away, axis=1).min() > CLEAR_M:
            return Crossing(middle + BESIDE_M * away, -speed * away, 2.0 * BESIDE_M / speed)


class Timed:
    """A controller whose steps are timed. times: the processor time of each step, ms."""

    def __init__(self, controller: Controller, times: list[float]) -> None:
        self._controller, self.times = controller, times

    def __getattr__(self, name: str) -> Any:
        return getattr(self._controller, name)

    def step(self, *given: Any) -> Plan:
        started = thread_time_ns()
        plan = self._controller.step(*given)
        self.times.append(1e-6 * (thread_time_ns() - started))
        return plan


def covered_depth(session: TorqueSession, left_out: set[tuple[int, int]]) -> tuple[float, str]:
    """Returns the deepest penetration between bodies whose distance is kept, m, and the names of the two
    bodies."""
    robot, found = session.robot, (0.0, "")
    for each in session.plant.contacts:
        joints = [joint_of(robot, name) for name in each.between]
        pair = (min(joints), max(joints))
        if pair[1] > 0 and pair not in left_out and each.depth > found[0]:
            found = each.depth, " – ".join(each.between)
    return found


def joint_of(robot: Robot, name: str) -> int:
    """Returns the joint that carries a link, and 0 for an object of the world."""
    return robot.model.frames[robot.frame_id(name)].parentJoint if name in robot.frames else 0


def run(
    robot: str,
    chains: int,
    seed: int,
    changes: Sequence[str],
    controller: str,
    balls: bool = False,
    tell: Callable[[Total, list[float]], None] = lambda *_: None,
) -> tuple[Total, list[float]]:
    """Runs all chains of a robot. The chains drag targets or, with `balls`, a ball through the arm. `tell` is
    called with the results after each chain."""
    rng, total, times = np.random.default_rng(seed), Total(), []
    scene = scene_of(robot, seed)
    settings = with_assignments(replace(scene.settings, controller=controller), changes)
    world = (
        (*scene.world, Thing(Ball("ball", tuple(AWAY.tolist()), BALL_M), mass_kg=1.0))
        if balls
        else scene.world
    )
    left_out = {(each.first, each.second) for each in cover_of(scene.robot).excluded}
    for _ in range(chains):
        session = TorqueSession(replace(scene, settings=settings, world=world))
        session.controller = cast(Controller, Timed(session.controller, times))
        deepest = fastest = 0.0
        total.chains += 1
        for drag in range(DRAGS):
            total.drags += 1
            path = crossing(session, rng) if balls else None
            for event in () if balls else drags(session, rng):
                session.post(event)
            crossed, rest = path.seconds if path else APART_S, REST_S if drag == DRAGS - 1 else 0.0
            seconds = max(crossed, rest) if path is None else crossed + rest
            for tick in range(round(seconds / session.step_s)):
                if path is not None:
                    t = tick * session.step_s
                    there = (
                        (path.start + t * path.velocity, path.velocity) if t < crossed else (AWAY, 0.0 * AWAY)
                    )
                    session.plant.carry(0, *there)
                session.tick()
                assert session.plan is not None
                total.unsolved += session.plan.unsolved
                fastest = max(fastest, float(np.abs(session.plant.v / session.robot.v_limit).max()))
                if session.plant.touch.depth > DEEP_M:
                    deep, where = covered_depth(session, left_out)
                    if deep > max(deepest, total.deepest):
                        total.where = where
                    deepest = max(deepest, deep)
        total.deepest, total.deep = max(total.deepest, deepest), total.deep + (deepest > DEEP_M)
        total.speed = max(total.speed, fastest)
        total.lost += session.plant.broken or not fastest <= LOST_SPEED
        total.resting += bool(np.abs(session.plant.v).max() < AT_REST)
        tell(total, times)
    return total, times


def line(robot: str, total: Total, times: Sequence[float]) -> str:
    """Returns a line of the table."""
    return (
        f"| {robot} | {total.drags} | {1e3 * total.deepest:.2f} {total.where} | {total.deep} | "
        f"{total.speed:.2f} | {total.lost} | {total.unsolved} | {total.resting} of {total.chains} | "
        f"{np.median(times):.2f}, {max(times):.1f} |"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--chains", type=int, default=25)
    parser.add_argument("--robots", nargs="*", default=list(ROBOTS), choices=ROBOTS)
    parser.add_argument("--off", action="store_true")
    parser.add_argument("--balls", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--controller", default="himpc")
    parser.add_argument("--set", nargs="*", default=[], dest="changes")
    given = parser.parse_args(arguments)
    changes = [f"avoidance.on={'false' if given.off else 'true'}", *given.changes]
    print(
        "| robot | drags | deepest, mm | chains deeper than 1 mm | speed | lost | unsolved | at rest | ms |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    worst = 0
    for robot in given.robots:
        total, times = run(
            *(robot, given.chains, given.seed, changes, given.controller, given.balls),
            tell=lambda *found, robot=robot: print(line(robot, *found), file=sys.stderr, flush=True),
        )
        print(line(robot, total, times), flush=True)
        bad = total.deep or total.lost or total.resting < 0.95 * total.chains
        worst = max(worst, int(bool(bad)))
    return worst


if __name__ == "__main__":
    sys.exit(main())
