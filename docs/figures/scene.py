"""A torque-level scene as data for a browser: settings, start, script, and the memory of its controllers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pinocchio as pin

from docs.figures.controls import controls
from docs.figures.model import KINDS, model_of, model_text
from docs.figures.pack import Pack
from docs.figures.robot import mechanics
from himpc.export.image import Image, image_of
from himpc.tasks import FramePosition, Task
from himpc.tasks.axes import OnAxes
from lessons.events import Event, Push, as_data
from lessons.scenes.torque_scene import TorqueScene
from lessons.session.controllers import controller_of
from lessons.session.observed import objects_of
from lessons.session.torque import TorqueSession
from lessons.settings.torque import TorqueSettings
from robots import InputError, Robot
from robots.world import Floor, Post


def scene_data(
    scene: TorqueScene, pack: Pack, horizons: Sequence[int] = (), wide: bool = False
) -> dict[str, Any]:
    """Returns the data of a scene and adds the memory of its controllers to the pack.

    Args:
        scene: the scene with its settings.
        pack: receives the memory of the controllers.
        horizons: the values of N that can be chosen besides the scene's own N.
        wide: whether the most used groups of controls are open at first.

    Raises:
        InputError: the scene's controller cannot be exported.
    """
    settings, robot = scene.settings, scene.robot
    session = TorqueSession(replace(scene, events=()), 0)
    references, around = session.references, objects_of(session.plant)
    force = settings.limits
    plant = {each.name: getattr(settings.plant, each.name) for each in fields(settings.plant)}
    own = tuple(level.name for level in settings.levels)
    images, made = {}, {}
    for N in sorted({settings.horizon, *horizons}):
        changed = settings.changed("horizon", N)
        assert isinstance(changed, TorqueSettings)
        # A simulation may have any limits that himpc-lab's settings have.
        made[N] = image_of(controller_of(changed, robot), robot, references, None, math.inf, around)
        images[str(N)] = _told(made[N], pack)
    image = made[settings.horizon]
    targets = {task["name"]: task["target"] for task in image.manifest["tasks"]}
    told = {
        "name": scene.name,
        "robot": robot.name,
        "controller": settings.controller,
        "period": settings.T_s,
        "horizon": settings.horizon,
        "order": list(own),
        "duration": scene.duration,
        "start": {
            "q": scene.q_0.tolist(),
            "v": scene.v_0.tolist(),
            "tau": None if scene.tau_0 is None else scene.tau_0.tolist(),
        },
        "M_bar": list(settings.M_bar),
        "M_bar_scale": settings.M_bar_scale,
        "R_on": settings.R_on,
        "deadline_ms": settings.deadline_ms,
        "solve_ms_per_knot": settings.solve_ms_per_knot,
        "levels": [
            {"name": level.name, "Q": level.Q, "R": level.R, "enabled": level.enabled}
            for level in settings.levels
        ],
        "tasks": [
            _task(robot, task) | {"level": place, "target": targets[task.name]}
            for place, level in enumerate(settings.levels)
            for task in level.tasks
        ],
        "limits": {
            name: getattr(force, name)
            for name in ("torque", "velocity", "position", "torque_scale", "velocity_scale")
        },
        "plant": {name: value for name, value in plant.items() if name not in _NOT_HERE},
        "model": model_text(robot, scene.world),
        "poses": _poses(scene),
        "objects": _objects(scene),
        "free": _free(scene),
        "events": [{"t": t, **_event(robot, event)} for t, event in scene.events],
        "images": images,
        "fields": _fields(image),
    }
    return told | {"controls": controls(told, robot, mechanics(robot)["reach"], horizons, wide)}


_NOT_HERE = ("diagonal_scale", "torque_lag_ms", "delay_ms")
"""Settings of the plant that a browser does not have."""


def refuse(scene: TorqueScene) -> None:
    """Raises InputError if a browser cannot run a scene."""
    plant = scene.settings.plant
    if np.any(np.asarray(plant.diagonal_scale) != 1.0) or plant.torque_lag_ms or plant.delay_ms:
        raise InputError(
            f"{', '.join(_NOT_HERE[:-1])} and {_NOT_HERE[-1]} of the plant are not simulated in a browser"
        )
    session = TorqueSession(replace(scene, events=()), 0)
    image_of(session.controller, scene.robot, session.references)


def _task(robot: Robot, task: Task) -> dict[str, Any]:
    frame = None
    if isinstance(task, FramePosition):
        found = robot.model.frames[robot.frame_id(task.frame or robot.tip)]
        frame = {"joint": found.parentJoint, "pos": found.placement.translation.tolist()}
    return {
        "name": task.name,
        "axes": task.axes if isinstance(task, OnAxes) else "",
        "unit": task.unit,
        "K_p": task.K_p,
        "K_v": task.K_v,
        "frame": frame,
    }


def _event(robot: Robot, event: Event) -> dict[str, Any]:
    body = {"joint": robot.moving_body(event.body)} if isinstance(event, Push) else {}
    return as_data(event) | body


def _poses(scene: TorqueScene) -> list[float]:
    """Returns position and quaternion x y z w of each body at the start, for the first picture."""
    model = scene.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, scene.q_0)
    return [
        value
        for placement in list(data.oMi)[1:]
        for value in (*placement.translation, *pin.Quaternion(placement.rotation).coeffs())
    ]


def _objects(scene: TorqueScene) -> list[dict[str, Any]]:
    """Returns the shapes of the objects in the order of their bodies. Floors are omitted, because every
    picture has a floor."""
    model = model_of(scene.robot, scene.world)
    found = []
    for place, thing in enumerate(scene.world):
        body, geom = model.body(f"object{place}"), model.geom(f"shape{place}")
        if not isinstance(thing.shape, Floor):
            found.append(
                {"body": f"object{place}", "kind": KINDS[int(geom.type[0])], "size": geom.size.tolist()}
                | {"pose": [*body.pos.tolist(), *np.roll(body.quat, -1).tolist()]}
            )
    return found


def _free(scene: TorqueScene) -> list[dict[str, float]]:
    """Returns index and height of the known point above the middle, m, of the objects that can move. They are
    in the order of MuJoCo's free joints."""
    return [
        {"index": index, "above": -0.5 * thing.shape.height if isinstance(thing.shape, Post) else 0.0}
        for index, thing in enumerate(scene.world)
        if thing.free
    ]


def _told(image: Image, pack: Pack) -> dict[str, Any]:
    """Returns the memory, and those parts of its manifest that the page needs."""
    manifest = image.manifest
    kept = [{key: each[key] for key in ("name", "type", "shape", "offset")} for each in manifest["arrays"]]
    told = {key: manifest[key] for key in ("joints", "digest", "tasks", "levels", "objects")}
    return {"memory": pack.add(image.memory), "manifest": told | {"arrays": kept}}


def _fields(image: Image) -> list[tuple[str, str, int, int]]:
    """Returns the fields of telemetry and their places in the kernel's memory: (name, array, first number,
    count). The page writes the fields that have no array."""
    manifest = image.manifest
    arrays = {each["name"]: each for each in manifest["arrays"]}
    n, place = len(manifest["joints"]), arrays["task"]["offset"]
    rows = np.frombuffer(image.memory, np.int64, 4 * len(manifest["tasks"]), place).reshape(-1, 4)
    own = ("t", "gauge_norm", "gauge_radius", "unsolved", "late", "contact_force")
    fields = [(name, "", 0, 1) for name in own]
    fields += [(name, "", 0, n) for name in ("q", "v", "tau", "tau_demand", "tau_0")]
    fields += [(f"active/{level['name']}", "", 0, 1) for level in manifest["levels"]]
    fields += [("at_bound", "at_bound", 0, n), ("delta_tau", "delta_tau", 0, n)]
    fields += [("priority_leak", "priority_leak", 0, 1)]
    fields += [(name, "limits", n * row, n) for name, row in _BOUNDS.items()]
    for task in manifest["tasks"]:
        first = int(rows[task["index"], 2])
        for field, array in (("error", "error"), ("x", "value")):
            fields.append((f"{field}/{task['name']}", array, first, task["rows"]))
    return fields


_BOUNDS = {"tau_lower": 0, "tau_upper": 1, "v_limit": 2, "q_lower": 6, "q_upper": 7}
"""Rows of `limits` in the kernel's memory, see `himpc/tick/kernel/arrays.py`."""
