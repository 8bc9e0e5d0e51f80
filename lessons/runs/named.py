"""Finds scenes and tasks by name or by the path of a file, and checks those of a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache, partial
from types import ModuleType
from typing import Any, get_args

import numpy as np

from himpc.kinematics.configuration import Configuration
from himpc.stack import Level
from himpc.tasks import Task
from lessons.events import Event
from lessons.own.files import Source, is_file, read, sentence
from lessons.own.kinds import expected, kind_of
from lessons.own.load import alone, judged, load
from lessons.scenes.catalog import as_torque_scene, attached, load_scene
from lessons.scenes.scene import Scene, TorqueScene
from robots import InputError, Robot
from robots.errors import shortened


def check_scene(scene: Scene) -> None:
    """Raises InputError if a scene cannot begin or has an impossible event. Exceptions of the scene's own
    code are passed on."""
    from lessons.session.start import begin  # only here: to find a scene by name must load no controller

    check_duration(scene.duration)
    for entry in scene.events:
        if not (isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[1], get_args(Event))):
            raise InputError(
                f"an event is {shortened(repr(entry), 80)}: give (seconds, event of lessons.events), e.g. "
                '(1.0, Push("link_3", force=(0.0, 5.0, 0.0)))'
            )
    make: Any = getattr(scene, "references", None)
    if make is not None:
        references = make(scene.robot, scene.settings.levels)
        names = [task.name for level in scene.settings.levels for task in level.tasks]
        if not isinstance(references, dict) or not references.keys() <= set(names):
            raise InputError(
                f"its references are {shortened(repr(references), 80)}: return a dict of references by task "
                f"name; the tasks are {', '.join(names)}"
            )
    session = begin(replace(scene, events=()))
    for number, (_, event) in enumerate(scene.events, start=1):
        session.post(event)
        session.drain()
        if len(session.log) < number:
            raise InputError(session.notices[-1])
    session.notices.clear()  # the scene may show what happens with settings that a notice is about
    session.tick()
    if session.notices:
        raise InputError(session.notices[0])


def check_duration(seconds: Any) -> None:
    """Raises InputError unless `seconds` is a finite number above 0."""
    number = isinstance(seconds, (int, float)) and not isinstance(seconds, bool)
    if not (number and math.isfinite(seconds) and seconds > 0):
        raise InputError(f"duration is {shortened(repr(seconds), 40)}: give seconds, more than 0")


TASK_SCENE = "iiwa14-hold"
"""The scene in which a user's task runs if no scene is named."""


def scene_named(
    name: str,
    urdf: str | None = None,
    tip: str | None = None,
    urdf_text: str | bytes | None = None,
    hold: tuple[str, ...] = (),
) -> Scene:
    """Returns a scene by its name, or the scene or task of a file; the arguments are those of `load_scene`.

    Raises:
        InputError: see `load_scene`; or the file cannot be used, and the message names the line.
    """
    if not is_file(name):
        return load_scene(name, urdf, tip, urdf_text, hold)
    if (urdf, tip, urdf_text, hold) != (None, None, None, ()):
        raise InputError(f"{name} brings its own robot: leave out --urdf, --tip, --tool and --hold")
    return _scene_of(read(name))


@lru_cache(maxsize=64)
def _scene_of(source: Source) -> Scene:
    """Returns the scene of a file. A file is tested again only if its content has changed."""
    module = module_of(source)
    if kind_of(module) == "task":
        return with_task(load_scene(TASK_SCENE), source.path)
    expected(module, "scene")
    constant = vars(module).get("SCENE")
    scene = called(source, vars(module)["scene"]) if constant is None else constant
    if not isinstance(scene, Scene):
        raise InputError(
            f"{source.path}: its scene is a {type(scene).__name__}: make it with TorqueScene or "
            "VelocityScene, or change a scene from lessons.load_scene"
        )
    called(source, partial(check_scene, scene))
    return replace(scene, name=source.path)


def task_in(name: str) -> Task:
    """Returns the task of a file. Raises InputError if the file cannot be used."""
    module = module_of(read(name))
    expected(module, "task")
    task = vars(module)["TASK"]
    if not isinstance(task, Task):
        raise InputError(f"{name}: TASK is a {type(task).__name__}: make it with a subclass of Task")
    return task


def with_task(scene: Scene, name: str) -> TorqueScene:
    """Returns a scene with the task of a file as a level of its own, below the first one.

    Raises:
        InputError: the file cannot be used, the scene takes velocities, or the task's Jacobian is wrong.
    """
    scene = as_torque_scene(scene, "a task of your own")
    source, task = read(name), task_in(name)
    called(source, lambda: check_task(task, scene.robot, name))
    first, *others = scene.settings.levels
    levels = (first, Level((task,)), *others)
    return replace(scene, settings=replace(scene.settings, stack=levels, own_tasks=((name, task),)))


def with_tasks(scene: Scene, files: Iterable[str]) -> Scene:
    """Returns the scene with the tasks of files added to the kinds that its stack may name. A scene at
    velocity level is returned unchanged.

    Raises:
        InputError: a file cannot be used, or the task's Jacobian is wrong.
    """
    return with_files(scene, (), files)


def with_files(scene: Scene, controllers: Iterable[str], tasks: Iterable[str]) -> Scene:
    """Returns the scene with users' files attached: files of controllers that it may use, and files of tasks
    that its stack may name. A scene at velocity level is returned unchanged.

    Raises:
        InputError: the file of a task cannot be used, or the task's Jacobian is wrong.
    """
    return attached(scene, controllers, {name: _task_for(scene.robot, name) for name in tasks})


def misfits(robot: Robot, files: Iterable[str]) -> dict[str, str]:
    """Returns the error messages of the files whose task cannot be used on a robot, by file."""
    messages = {}
    for name in files:
        try:
            _task_for(robot, name)
        except InputError as error:
            messages[name] = str(error)
    return messages


def _task_for(robot: Robot, name: str) -> Task:
    """Returns the task of a file. Raises InputError if it cannot be used at all or on this robot."""
    task = task_in(name)
    called(read(name), partial(check_task, task, robot, name))
    return task


def check_task(task: Task, robot: Robot, name: str) -> None:
    """Raises InputError if value, error, Jacobian and coordinates of a task do not fit together."""
    Level((task,))  # raises InputError for invalid gains
    rng = np.random.default_rng(0)
    data, h, m = robot.model.createData(), 1e-6, len(task.coordinates(robot))
    low, high = np.maximum(robot.q_lower, -1.5), np.minimum(robot.q_upper, 1.5)

    def value(q: Any) -> Any:
        return np.array(task.value(Configuration(robot, data, q, np.zeros(robot.n))))

    for _ in range(3):
        q = rng.uniform(low, high)
        J = task.jacobian(Configuration(robot, data, q, np.zeros(robot.n)))
        if np.shape(J) != (1, m, robot.n):
            raise InputError(
                f"{name}: the Jacobian of task '{task.name}' has shape {np.shape(J)} and must have "
                f"(N, {m}, {robot.n}): one matrix per knot, a row per coordinate, a column per joint"
            )
        here = value(q)
        for joint in range(robot.n):
            step = h * np.eye(robot.n)[joint]
            moved = np.asarray(task.error(value(q + step), here)) - task.error(value(q - step), here)
            if moved.shape != (m,):
                raise InputError(
                    f"{name}: the error of task '{task.name}' has shape {moved.shape}: it needs ({m},)"
                )
            miss = float(np.abs(moved / (2 * h) - J[0][:, joint]).max())
            if not miss < 1e-4:
                raise InputError(
                    f"{name}: the Jacobian of task '{task.name}' is not that of its value: for joint "
                    f"{robot.joint_names[joint]} it is off by {miss:.2g}"
                )


def module_of(source: Source) -> ModuleType:
    """Returns the module of a file, loaded once per content. Raises InputError, with the line."""
    judged(source)
    return _module_of(source)


@lru_cache(maxsize=64)
def _module_of(source: Source) -> ModuleType:
    return load(source)


def called(source: Source, function: Callable[[], Any]) -> Any:
    """Calls a function that runs code of the file. Raises InputError, with the line, for every exception."""
    try:
        with alone(source.path):
            return function()
    except (Exception, SystemExit) as error:
        if isinstance(error, InputError) and str(error).startswith(source.path):
            raise
        raise InputError(sentence(source.path, error)) from None
