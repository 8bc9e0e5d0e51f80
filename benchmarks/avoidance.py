"""Drags robots at random into their surroundings and into themselves, with default settings.

    python -m benchmarks.avoidance [--chains 25] [--robots iiwa14 panda baxter generated lamp FILE.urdf …]
                                   [--often] [--off] [--balls] [--seed 1] [--controller himpc]
                                   [--set PATH=VALUE …]

Every chain drags the hands of a robot four times, once a second, in position alone or in position and
orientation. Each new target is 0.1 to 0.6 m from the present target in a random direction, so that many
targets lie in the floor, in the robot or out of reach. Then the robot has three seconds to come to rest.

With `--often`, all targets jump every 80 ms for two seconds instead, from their values at the start:
positions by normal samples of 0.3 m, orientations of 0.6 rad, postures of 0.3 rad. (Jumps from the present
values would add up, and the references, whose speed is limited, would still move three seconds later.) With
`--balls`, a ball is dragged through the arm four times instead, at 0.15 to 0.5 m/s, from 0.6 m before a
moving link to 0.6 m behind it. The ball does not pass through the first three joints, which cannot move out
of its way. Any controller can run; `--off` switches distances off.

The program prints a line of a Markdown table for each robot: the drags; the largest force between bodies
whose distance is kept, and these bodies; the chains in which this force exceeds 50 N; the largest share of
the velocity limits; lost runs; unsolved QPs; the chains whose joints are slower than 0.05 rad/s at the end;
and the median and the longest processor time of a step. It prints one line on the error stream after every
chain. The exit code is 1 if a force exceeds 50 N, a joint is faster than 1.05 times its limit (with `--off`
1.5 times, and forces are not judged), a run is lost, or more than 5 % of the chains do not come to rest.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from time import thread_time_ns
from typing import Any, NamedTuple, cast

import numpy as np
import pinocchio as pin
import tyro
from numpy.typing import NDArray

import lessons.course
from himpc.controllers.controller import Controller
from himpc.kinematics.configuration import Configuration
from himpc.plan import Plan
from himpc.rotation import exp3, quaternion
from lessons.events import MoveTarget
from lessons.scenes.catalog import torque_scene
from lessons.scenes.hold import hold
from lessons.scenes.scene import TorqueScene
from lessons.session.session import LOST_SPEED
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import with_assignments
from robots import Robot
from robots.covering.cover_of import cover_of
from robots.errors import InputError
from robots.world import Ball, Thing

Array = NDArray[np.float64]

DRAGS, APART_S, REST_S = 4, 1.0, 3.0
FAR_M, TURN_RAD = (0.1, 0.6), 1.0
"""The shortest and the longest distance of a drag, and its largest rotation."""
EVERY_S, OFTEN = 0.08, 25
"""The time between two jumps of `--often`, and their number."""
JUMP_M, JUMP_RAD, JUMP_JOINT = 0.3, 0.6, 0.3
HARD_N, AT_REST = 50.0, 0.05
FAST, FAST_OFF = 1.05, 1.5
"""Largest shares of the velocity limits, with and without distances."""
BALL_M, BESIDE_M, BALL_SPEED = 0.08, 0.6, (0.15, 0.5)
"""Radius of a dragged ball, the length of its path before and behind a link, and its range of speeds, m/s."""
PAST_M, CLEAR_M = 0.25, 0.35
"""The smallest distance, m, between the ball's path and the first three joints of an arm, and between the
start of the path and the whole arm."""
AWAY = np.array([0.0, 0.0, 10.0])
"""The position at which the ball waits, m."""
SCENES = {"iiwa14": "iiwa14-hold", "panda": "panda-hold", "baxter": "baxter-hold"}
ROBOTS = (*SCENES, "generated", "lamp")
LAMP = str(Path(lessons.course.__file__).with_name("lamp.urdf"))


@dataclass
class Total:
    """The results of all chains of one robot."""

    drags: int = 0
    force: float = 0.0
    hard: int = 0
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
    if robot in SCENES:
        return torque_scene(SCENES[robot])
    if robot == "generated":
        return hold(None, None, generated(seed))
    return hold(LAMP if robot == "lamp" else robot, None)


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
                turn = exp3(rng.uniform(0.0, TURN_RAD) * axis / np.linalg.norm(axis))
                found.append(MoveTarget(task.name, tuple(quaternion(turn @ target.raw).tolist())))
    return found


def jumps(
    session: TorqueSession, rng: np.random.Generator, start: Configuration | None = None
) -> Iterator[MoveTarget]:
    """Yields a jump of every target that can be moved: positions by a normal sample of 0.3 m, orientations of
    0.6 rad, postures of 0.3 rad. The jumps are from the values at `start`, or from the present targets."""
    for task in (task for level in session.scene.settings.levels for task in level.tasks):
        target = session.target(task.name)
        if target is None:
            continue
        raw = target.raw if start is None else task.target(start)
        if raw.ndim == 2:
            goal = quaternion(exp3(rng.normal(0.0, JUMP_RAD, 3)) @ raw)
        else:
            goal = raw + rng.normal(0.0, JUMP_M if task.unit == "m" else JUMP_JOINT, raw.shape)
        with suppress(InputError):  # a target outside the range of the task
            yield MoveTarget(task.name, tuple(goal.tolist()))


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


def covered_force(session: TorqueSession, left_out: set[tuple[int, int]]) -> tuple[float, str]:
    """Returns the largest force between bodies whose distance is kept, N, and the names of the two bodies."""
    robot, found = session.robot, (0.0, "")
    for each in session.plant.contacts:
        joints = [joint_of(robot, name) for name in each.between]
        pair, force = (min(joints), max(joints)), float(np.linalg.norm(each.force))
        if pair[1] > 0 and pair not in left_out and force > found[0]:
            found = force, " – ".join(each.between)
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
    often: bool = False,
    tell: Callable[[Total, list[float]], None] = lambda *_: None,
) -> tuple[Total, list[float]]:
    """Runs all chains of a robot. The chains drag targets, with `often` every 80 ms, or, with `balls`, a ball
    through the arm. `tell` is called with the results after each chain."""
    rng, total, times = np.random.default_rng(seed), Total(), []
    scene = scene_of(robot, seed)
    settings = with_assignments(replace(scene.settings, controller=controller), changes)
    ball = Thing(Ball("ball", tuple(AWAY.tolist()), BALL_M), mass_kg=1.0)
    world = (*scene.world, *([ball] if balls else []))
    left_out = {(each.first, each.second) for each in cover_of(scene.robot).excluded}
    for _ in range(chains):
        session = TorqueSession(replace(scene, settings=settings, world=world))
        session.controller = cast(Controller, Timed(session.controller, times))
        hardest = fastest = 0.0
        total.chains += 1
        start = Configuration(scene.robot, scene.robot.model.createData(), scene.q_0, np.zeros(scene.robot.n))
        many, apart = (OFTEN, EVERY_S) if often else (DRAGS, APART_S)
        for drag in range(many):
            total.drags += 1
            path = crossing(session, rng) if balls else None
            moved = () if balls else jumps(session, rng, start) if often else drags(session, rng)
            for event in moved:
                session.post(event)
            crossed, rest = path.seconds if path else apart, REST_S if drag == many - 1 else 0.0
            seconds = max(crossed, rest) if path is None else crossed + rest
            for tick in range(round(seconds / session.step_s)):
                if path is not None:
                    t = tick * session.step_s
                    here = (path.start + t * path.velocity, path.velocity)
                    session.plant.carry(0, *(here if t < crossed else (AWAY, 0.0 * AWAY)))
                session.tick()
                assert session.plan is not None
                total.unsolved += session.plan.unsolved
                fastest = max(fastest, float(np.abs(session.plant.v / session.robot.v_limit).max()))
                if session.plant.touch.force > hardest:
                    force, where = covered_force(session, left_out)
                    if force > max(hardest, total.force):
                        total.where = where
                    hardest = max(hardest, force)
        total.force, total.hard = max(total.force, hardest), total.hard + (hardest > HARD_N)
        total.speed = max(total.speed, fastest)
        total.lost += session.plant.broken or not fastest <= LOST_SPEED
        total.resting += bool(np.abs(session.plant.v).max() < AT_REST)
        tell(total, times)
    return total, times


def line(robot: str, total: Total, times: Sequence[float]) -> str:
    """Returns a line of the table."""
    return (
        f"| {robot} | {total.drags} | {total.force:.0f} {total.where} | {total.hard} | "
        f"{total.speed:.2f} | {total.lost} | {total.unsolved} | {total.resting} of {total.chains} | "
        f"{np.median(times):.2f}, {max(times):.1f} |"
    )


def main(
    chains: int = 25, robots: tuple[str, ...] = ROBOTS, often: bool = False, off: bool = False,
    balls: bool = False, seed: int = 1, controller: str = "himpc", set: tuple[str, ...] = (),
) -> int:  # fmt: skip
    """Does what the module says."""
    changes = [*(["avoidance.on=false"] if off else []), *set]
    print("| robot | drags | largest force, N | chains above 50 N | speed | lost | unsolved | at rest | ms |")
    print("|---|---|---|---|---|---|---|---|---|")
    worst = 0
    for robot in robots:
        total, times = run(
            *(robot, chains, seed, changes, controller, balls, often),
            tell=lambda *found, robot=robot: print(line(robot, *found), file=sys.stderr, flush=True),
        )
        print(line(robot, total, times), flush=True)
        bad = total.lost or total.resting < 0.95 * total.chains
        bad = bad or (total.speed > FAST_OFF if off else total.hard or total.speed > FAST)
        worst = max(worst, int(bool(bad)))
    return worst


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
