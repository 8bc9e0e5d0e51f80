"""Prepares a drive from a scene: exports the controller, with its targets at the pose of the arm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.arm.drags import drags_of
from app.arm.drive import Drag
from himpc.export.image import Image, image_of
from himpc.export.native import NativeController
from lessons.scenes.torque_scene import TorqueScene
from lessons.session.torque import TorqueSession
from robots import InputError, Plant
from robots.arms.arm import ArmLimits

Array = NDArray[np.float64]

_NEAR = 0.05
"""Largest error of a task, m or rad, at which the controller may take control of the arm."""


class Prepared(NamedTuple):
    """The data of a scene that a drive needs: the exported controller, the limits in force, a simulated robot
    in the pose of the arm, the drags, and a session that begins in this pose. The session simulates no
    gravity, since an arm compensates its own gravity."""

    image: Image
    limits: ArmLimits
    plant: Plant
    drags: list[Drag]
    session: TorqueSession


def prepared(scene: TorqueScene, start: Array, limits: ArmLimits, texts: Sequence[str]) -> Prepared:
    """Prepares a drive.

    Args:
        scene: a scene whose robot has the joints of the arm, in the same order.
        start: (n,) rad, the joint positions of the arm; targets that can be dragged begin at this pose.
        limits: the limits of the arm.
        texts: see `drags_of`.

    Raises:
        InputError: the arm is outside the limits in force, or the scene cannot be exported.
    """
    robot = scene.robot
    force = limits.with_robot(robot)
    for name, q, low, high in zip(robot.joint_names, start, force.q_lower, force.q_upper, strict=True):
        if not low < q < high:
            raise InputError(
                f"joint '{name}' of the arm is at {q:.3f} rad, outside {low:.3f} … {high:.3f} rad: "
                "move the arm by hand into the range"
            )
    weightless = replace(scene.settings, plant=replace(scene.settings.plant, gravity=False))
    rest = replace(scene, settings=weightless, q_0=start, v_0=np.zeros(robot.n), tau_0=None, events=())
    session = TorqueSession(rest)
    image = image_of(session.controller, robot, session.references)
    plant = Plant(robot, scene.settings.plant, scene.settings.T_s, scene.world)
    plant.reset(start)
    return Prepared(image, force, plant, drags_of(texts, session, image.manifest), session)


def nominal(scene: TorqueScene, plain: TorqueScene) -> TorqueScene:
    """Returns `scene` with the plant of the scene `plain`. `--set plant.…` thus changes only
    the simulated arm (see `himpc-lab arm`), and not the model beside the arm."""
    return replace(scene, settings=replace(scene.settings, plant=plain.settings.plant))


def check_start(controller: NativeController, start: Array) -> None:
    """Raises InputError if the motion of a task begins far from the pose of the arm."""
    controller.tick(start, np.zeros(controller.n))
    error, first = controller.view("error"), 0
    for task in controller.manifest["tasks"]:
        own = np.abs(error[first : first + task["rows"]])
        first += task["rows"]
        if task["target"] == "fixed" and own.max(initial=0.0) > _NEAR:
            raise InputError(
                f"the motion of task '{task['name']}' begins {own.max():.2f} {task['unit']} from where the "
                "arm is: move the arm to the scene's start, or choose a scene with targets to drag"
            )


def maker(library: Path, image: Image) -> Callable[[], NativeController]:
    """Returns a function that creates independent controllers."""
    return lambda: NativeController.of(library, image)
