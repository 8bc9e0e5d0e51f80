"""Runs every kind of task on every robot of the catalog in closed loop under two controllers. The task is
held. Then its target is dragged to the value of the task in another posture, so that it can be reached.

    python -m benchmarks.every_task [--seconds 3] [--robot NAME]

The program prints a row per robot and kind: the error after holding and after dragging (mm or degrees).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import tyro
from numpy.typing import NDArray

from himpc.kinematics.configuration import Configuration
from himpc.rotation import quaternion
from himpc.tasks import KINDS, Damping, Joints, Posture, Task
from lessons.events import MoveTarget
from lessons.scenes.catalog import prepared, torque_scene
from lessons.scenes.names import SCENES
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import assignment
from robots import CATALOG, Robot
from robots.joints import joint_axis

CONTROLLERS = ("himpc", "hqp")
HELD_FOR = 0.1  # s
SETTLED = {"m": 1e-3, "rad": np.deg2rad(0.1)}
"""For each unit of a coordinate, the error below which the coordinate counts as settled."""


@dataclass(frozen=True)
class Found:
    """The errors of all tasks of one kind in a run.

    Attributes:
        held, settled: the largest error of a coordinate after holding and after dragging, divided by the
            value of `SETTLED` for its unit (a prismatic joint has the unit m).
        moved: the distance of the drag, in the same units.
        calm: the largest ratio of |v| to its limit at the end.
    """

    robot: str
    kind: str
    controller: str
    held: float
    moved: float
    settled: float
    calm: float


@cache
def scene_of(robot: str) -> TorqueScene:
    """Returns the scene in which a robot of the catalog holds its posture."""
    own = f"{robot}-hold"
    return torque_scene(own) if own in SCENES else torque_scene("hold", robot)


def entry(kind: str, scene: TorqueScene) -> dict[str, Any]:
    """Returns a task of the given kind that the robot of a scene can influence."""
    robot = scene.robot
    tasks = [task for level in scene.settings.levels for task in level.tasks]
    fields = {name for of in KINDS[kind].makes for name in of.__dataclass_fields__}
    given: dict[str, Any] = {"task": kind, "name": "x"}
    if "axes" in fields and getattr(tasks[0], "axes", "") == "xy" and "pose" not in kind:
        given["axes"] = "z" if "orientation" in kind else "xy"
    if "root" in fields:
        given["root"] = robot.frames[len(robot.frames) // 3]
    own: dict[str, dict[str, Any]] = {
        "pointing": {"axis": "x"},
        "plane_distance": {"normal": [1.0, 0.0, 0.0]},
        "joints": {"joints": list(robot.joint_names[:2])},
    }
    return given | own.get(kind, {})


def measured(robot: str, kind: str, controller: str, seconds: float) -> Found:
    """Returns the results of a run in which the task is held, then dragged for some seconds."""
    scene = scene_of(robot)
    stack = [entry(kind, scene), {"task": "posture", "name": "rest"}]
    session = TorqueSession(prepared(scene, controller, [assignment("stack", stack)]))
    tasks = session.settings.levels[0].tasks
    run(session, HELD_FOR)
    held = off(session, tasks)
    rng = np.random.default_rng(0)
    q = session.plant.q + rng.uniform(0.05, 0.1, session.robot.n) * rng.choice([-1.0, 1.0], session.robot.n)
    there = Configuration(session.robot, session.robot.model.createData(), q, np.zeros(len(q)))
    for task in tasks:
        if session.target(task.name) is not None:
            value = np.asarray(task.target(there))
            given = quaternion(value) if value.ndim == 2 else value
            session.post(MoveTarget(task.name, tuple(given.tolist())))
    moved = 0.0
    for _ in range(20):
        run(session, seconds / 20)
        moved = max(moved, off(session, tasks))
    calm = float(np.abs(session.plant.v / session.robot.v_limit).max())
    return Found(robot, kind, controller, held, moved, off(session, tasks), calm)


def run(session: TorqueSession, seconds: float) -> None:
    until = session.t + seconds - 1e-9
    while session.t < until and session.diverged_at is None:
        session.drain()
        session.tick()


def off(session: TorqueSession, tasks: tuple[Task, ...]) -> float:
    """Returns the largest error in units of `SETTLED`, or infinity if control was lost."""
    plan = session.plan
    if plan is None or session.diverged_at is not None:
        return float("inf")
    return max(
        float(np.abs(plan.errors[task.name] / settled_within(task, session.robot)).max()) for task in tasks
    )


def settled_within(task: Task, robot: Robot) -> NDArray[np.float64]:
    """Returns the value of `SETTLED` for each coordinate, (m,)."""
    names, joints = task.coordinates(robot), {}
    if isinstance(task, (Joints, Posture, Damping)):
        joints = {
            name: joint_axis(robot.model, at)[0]
            for at, name in zip(robot.joints, robot.joint_names, strict=True)
        }
    return np.array([SETTLED["m" if joints.get(name, task.unit == "m") else "rad"] for name in names])


def main(seconds: float = 3.0, robot: str | None = None) -> int:
    """Does what the module says."""
    found = []
    for name in CATALOG if robot is None else (robot,):
        for kind in KINDS:
            for controller in CONTROLLERS:
                each = measured(name, kind, controller, seconds)
                found.append(each)
                print(
                    f"{name:16}{kind:22}{controller:7}held {each.held:8.2g}  moved {each.moved:8.3g}  "
                    f"settled {each.settled:8.2g}  v {each.calm:.1e}",
                    flush=True,
                )
    bad = [each for each in found if not (each.held < 1.0 and each.settled < 1.0)]
    print(f"{len(found)} runs, {len(bad)} not settled")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
