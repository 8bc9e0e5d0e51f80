"""A robot with only one moving joint can be loaded, holds its position and follows a dragged target."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from himpc import CONTROLLERS
from himpc.htmpc.clearance import CollisionModel
from lessons.events import MoveTarget
from lessons.recording.run import run
from lessons.scenes.catalog import load_scene
from lessons.scenes.scene import Scene
from robots.collision import Ball
from robots.reach import ReachJudge

ONE_JOINT = """<robot name="one"><link name="base"/><link name="arm"><inertial><origin xyz="0.1 0 0"/>
<mass value="1"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tool"/><joint name="j" type="{kind}"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="3" effort="50"/></joint><joint name="t" type="fixed">
<parent link="arm"/><child link="tool"/><origin xyz="0.3 0 0"/></joint></robot>"""
KINDS = ("revolute", "prismatic")


@cache
def scene_of(kind: str) -> Scene:
    """Returns the scene with the imported robot. The result is cached, because each import starts a
    process."""
    return load_scene("hold", urdf_text=ONE_JOINT.format(kind=kind))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_one_joint_holds_under_every_controller(controller: str, kind: str) -> None:
    scene = scene_of(kind)
    recording = run(replace(scene, settings=scene.settings.changed("controller", controller)), 0.3)
    assert np.isfinite(recording["tau"]).all()
    assert np.abs(recording["q"] - scene.robot.home).max() < 1e-3


@pytest.mark.parametrize("kind", KINDS)
def test_one_joint_follows_a_dragged_target(kind: str) -> None:
    """A target on the path of the joint is reached; a target beside the path causes no error message."""
    scene = scene_of(kind)
    there = (0.3 * np.cos(0.4), 0.3 * np.sin(0.4), 0.0) if kind == "revolute" else (0.3, 0.0, 0.4)
    moves = ((0.01, MoveTarget("position", there)),)
    reached = run(replace(scene, events=moves), 3.0)
    assert abs(reached["q"][-1, 0] - 0.4) < 0.01
    far = ((0.01, MoveTarget("position", (1.0, -2.0, 3.0))),)
    lost = run(replace(scene, events=far), 0.5)
    assert np.isfinite(lost["tau"]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_one_joint_is_judged_and_kept_clear(kind: str) -> None:
    robot = scene_of(kind).robot
    there = np.array([0.3 * np.cos(0.4), 0.3 * np.sin(0.4), 0.0] if kind == "revolute" else [0.3, 0.0, 0.4])
    assert ReachJudge(robot).solve(there).reachable
    clear = CollisionModel(robot, (Ball("ball", (0.5, 0.0, 0.0), 0.1),)).clearances(robot.home[None], 1.0)
    assert np.isfinite(clear.gradient).all()
