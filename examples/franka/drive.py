"""Drives a Franka arm, or a simulated one, by the exported controller of a scene: see README.md."""

from __future__ import annotations

import multiprocessing
import signal
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from examples.franka.franka import LIMITS, Franka
from examples.franka.guard import Array
from examples.franka.loop import Ended, Loop, Plan, Shared
from examples.franka.simulated import Model, SimulatedArm, hurry, watch
from himpc.export.image import Image, image_of
from himpc.export.native import NativeController, build
from lessons import load_scene, prepared
from lessons.session.observed import objects_of
from lessons.session.torque import TorqueSession
from robots import InputError, Plant
from robots.errors import unknown_name

_NEAR = 0.05  # m or rad: largest error of a task at which the controller may take control
Make = Callable[[], NativeController]
Moves = tuple[tuple[float, str, float, float, float], ...]


def drive(plan: Plan, arm: Callable[[], Any], make: Make, model: Model) -> tuple[Ended, Shared]:
    """Runs the loop, beside a process that watches it. Ctrl-C stops the arm gently."""
    controller = make()
    shared = Shared(plan, controller.view("error").size)
    # The fork shares the memory. A watcher that ends or hangs is silent, and the loop stops the arm gently.
    watcher = multiprocessing.get_context("fork").Process(target=watch, args=(model, shared), daemon=True)
    watcher.start()
    loop = Loop(arm(), controller, plan, shared)
    before = signal.signal(signal.SIGINT, lambda *_: setattr(loop, "interrupted", True))
    try:
        return loop.run(), shared
    finally:
        signal.signal(signal.SIGINT, before)
        watcher.kill()
        watcher.join()


def image_at(scene: Any, start: Array) -> tuple[Image, TorqueSession]:
    """Exports a scene's controller with its targets at a pose, (n,) rad, and without gravity."""
    still = replace(scene.settings, plant=replace(scene.settings.plant, gravity=False))
    rest = replace(scene, settings=still, q_0=start, v_0=np.zeros(scene.robot.n), tau_0=None, events=())
    session = TorqueSession(rest)
    around = objects_of(session.plant)
    return image_of(session.controller, scene.robot, session.references, observed=around), session


def check_start(controller: NativeController, start: Array) -> None:
    """Raises InputError if the motion of a task begins far from the pose of the arm."""
    controller.tick(start, np.zeros(controller.n))
    error = np.abs(controller.view("error"))
    for task in controller.manifest["tasks"]:
        own, error = error[: task["rows"]].max(initial=0.0), error[task["rows"] :]
        if task["target"] == "fixed" and own > _NEAR:
            far = f"begins {own:.2f} {task['unit']} from where the arm is"
            raise InputError(f"the motion of task '{task['name']}' {far}: move the arm to the scene's start")


def drags_of(moves: Moves, session: TorqueSession, image: Image) -> tuple[tuple[float, int, Array], ...]:
    """Returns the drags of (time, position task, x, y, z), s and m. Raises InputError for another task."""
    tasks = {each["name"]: each["index"] for each in image.manifest["tasks"] if each["target"] == "position"}
    at: dict[str, Any] = {name: session.target(name).raw for name in tasks}  # type: ignore[union-attr]
    drags = []
    for t, name, *by in sorted(moves):
        if name not in tasks:
            raise unknown_name("task with a position target", name, tasks)
        at[name] = at[name] + by
        drags.append((t, tasks[name], at[name]))
    return tuple(drags)


def main(
    scene: tyro.conf.Positional[str],
    robot: tyro.conf.Positional[str],
    set: tuple[str, ...] = (),
    drag: Moves = (),
    duration: float = 10.0,
    delay: int = 0,
    npz: str | None = None,
) -> int:
    """Drive a Franka arm, or a simulated one, by the exported controller of a scene.

    Args:
        scene: a scene with this arm, e.g. panda-hold; the targets begin at the arm's pose.
        robot: address of the arm, or "simulated".
        set: settings, e.g. limits.velocity_scale=0.3; plant.… describes the simulated arm only.
        drag: moves of position targets, e.g. 2 position 0.05 0 0 for 5 cm along x after 2 s.
        duration: s, at most 600.
        delay: number of periods after which a torque acts; 0: use the torque that the arm reports.
        npz: file for one row per period.
    """
    loaded = load_scene(scene)
    changed: Any = prepared(loaded, None, set)
    period, described, simulated = changed.settings.T_s, changed.robot, robot == "simulated"
    if not (0.0 < duration <= 600.0 and 0 <= delay <= 20 and (simulated or period == 1e-3)):
        raise InputError("--duration must be above 0 and at most 600 s, --delay from 0 to 20, T_s 0.001 s")
    start = changed.q_0 if simulated else Franka(robot).at_rest(described)

    def resting(settings: Any) -> Plant:
        plant = Plant(described, settings.plant, period, changed.world)
        plant.reset(start)
        return plant

    def arm() -> Any:
        return SimulatedArm(resting(changed.settings), period, True) if simulated else Franka(robot)

    limits = (arm().limits if simulated else LIMITS).with_robot(described, start)
    beside = replace(changed, settings=replace(changed.settings, plant=loaded.settings.plant))
    image, session = image_at(beside, start)
    with tempfile.TemporaryDirectory() as folder:
        make = partial(NativeController.of, build(Path(folder)), image)
        check_start(make(), start)
        drags = drags_of(drag, session, image)
        plan = Plan(limits, start, period, duration, drags, delay=delay, stuck=5.0)
        hurry(50)
        ended, shared = drive(plan, arm, make, Model(resting(beside.settings), make(), plan))
    print(f"ended: {ended.why}; it {'came' if ended.gently else 'did not come'} to rest under control")
    if npz:
        rows: Any = shared.rows[: int(shared.count[0])]
        fields: dict[str, Any] = {name: rows[name] for name in rows.dtype.names}
        np.savez_compressed(npz, q_model=shared.q_model[: len(rows)], **fields)
    return 0 if ended.wanted and ended.gently else 1


if __name__ == "__main__":
    try:
        sys.exit(tyro.cli(main))
    except InputError as error:
        sys.exit(f"drive: {error}")
