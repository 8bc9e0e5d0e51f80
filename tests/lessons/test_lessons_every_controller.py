"""Every registered controller holds every robot: those of the catalog at torque level, and those of the
scenes at velocity level."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from himpc import CONTROLLERS
from himpc.catalog import VELOCITY_CONTROLLERS
from lessons.recording.run import Recording, run
from lessons.scenes.catalog import torque_scene
from lessons.scenes.names import SCENES
from lessons.scenes.run_spec import RunSpec
from robots import CATALOG, load_robot

SECONDS, AGAIN = 2.0, 0.3
ON_PAPER = 0.6
"""Duration, s, for the controller in NumPy, whose tick takes a hundred times as long as a compiled one."""
ROBOTS = [name for name in CATALOG if f"{name}-hold" in SCENES]


def record(robot: str, controller: str, seconds: float) -> Recording:
    scene = torque_scene(f"{robot}-hold")
    return run(replace(scene, settings=scene.settings.changed("controller", controller)), seconds, seed=1)


OFTEN = {
    (controller, "planar3" if controller == "himpc_printed" else ROBOTS[place % len(ROBOTS)])
    for place, controller in enumerate(CONTROLLERS)
}
"""Pairs that run at every push, with every controller and every robot."""
PAIRS = [
    pytest.param(
        controller,
        robot,
        id=f"{controller}-{robot}",
        marks=()
        if (controller, robot) in OFTEN
        else pytest.mark.nightly("himpc/printed.py")
        if controller == "himpc_printed"
        else pytest.mark.nightly("himpc/controllers", "himpc/tick", "himpc/limits", "robots/plant.py"),
    )
    for controller in CONTROLLERS
    for robot in ROBOTS
]


def test_every_robot_runs_often() -> None:
    assert {robot for _, robot in OFTEN} == set(ROBOTS)


@pytest.mark.parametrize(("controller", "robot"), PAIRS)
def test_every_controller_holds_every_robot(controller: str, robot: str) -> None:
    """For 2 s of the hold scene the values are finite and the robot stays in place. A second run gives
    bitwise the same first 0.3 s."""
    seconds = ON_PAPER if controller == "himpc_printed" else SECONDS
    first, again = record(robot, controller, seconds), record(robot, controller, min(AGAIN, seconds / 4.0))
    assert first.session.settings.controller == controller
    assert len(first.rows) == round(seconds / first.session.settings.T_s)
    for name in ("q", "v", "tau", "tau_demand"):
        assert np.isfinite(first[name]).all()
        np.testing.assert_array_equal(first[name][: len(again.rows)], again[name])
    assert not first.session.notices
    assert np.abs(first["q"] - load_robot(robot).home).max() < 1e-2


@pytest.mark.parametrize("scene", ["iiwa14-htmpc", "panda-htmpc", "ridgeback-ur10-drag"])
@pytest.mark.parametrize("controller", VELOCITY_CONTROLLERS)
def test_every_velocity_controller_holds_every_robot(controller: str, scene: str) -> None:
    """For 1 s the robot stays in place, and its commands are within the limits. A second run gives bitwise
    the same first 0.2 s."""
    first, again = (
        run(RunSpec(scene, controller=controller, duration=seconds).prepared()) for seconds in (1.0, 0.2)
    )
    assert first.session.settings.controller == controller
    for name in ("q", "v", "tau"):
        assert np.isfinite(first[name]).all()
        np.testing.assert_array_equal(first[name][: len(again.rows)], again[name])
    assert not first.session.notices
    assert np.abs(first["q"] - first.session.robot.home).max() < 1e-2
