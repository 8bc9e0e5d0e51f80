"""The scenes by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TypeVar

from himpc.catalog import CONTROLLERS, VELOCITY_CONTROLLERS
from himpc.tasks import Task
from lessons.own.files import is_file
from lessons.scenes.circle import iiwa14_circle, iiwa14_circle_paper
from lessons.scenes.hold import hold as hold_scene
from lessons.scenes.hold import hold_of, iiwa14_table, panda_post, ridgeback_hold
from lessons.scenes.missions import velocity_scene
from lessons.scenes.names import ALL_SCENES, VELOCITY_SCENES
from lessons.scenes.planar import planar3_circle, planar3_conflict, planar3_plane, planar3_singular
from lessons.scenes.scene import Scene, TorqueScene
from lessons.scenes.two_arms import baxter_conflict, baxter_hold, baxter_tray
from lessons.settings.assignments import with_assignments
from lessons.settings.settings import SceneSettings
from lessons.settings.torque import TorqueSettings
from robots import InputError
from robots.errors import unknown_name

AnyScene = TypeVar("AnyScene", bound=Scene)
AnySettings = TypeVar("AnySettings", bound=SceneSettings)


_MAKERS: dict[str, Callable[[], TorqueScene]] = {
    "iiwa14-hold": lambda: hold_of("iiwa14"),
    "panda-hold": lambda: hold_of("panda"),
    "planar3-hold": lambda: hold_of("planar3"),
    "ridgeback-ur10-hold": ridgeback_hold,
    "iiwa14-table": iiwa14_table,
    "panda-post": panda_post,
    "planar3-plane": planar3_plane,
    "baxter-hold": baxter_hold,
    "baxter-tray": baxter_tray,
    "baxter-conflict": baxter_conflict,
    "planar3-circle": planar3_circle,
    "planar3-conflict": planar3_conflict,
    "planar3-singular": planar3_singular,
    "iiwa14-circle": iiwa14_circle,
    "iiwa14-circle-paper": iiwa14_circle_paper,
}


def load_scene(
    name: str,
    urdf: str | None = None,
    tip: str | None = None,
    urdf_text: str | bytes | None = None,
    hold: tuple[str, ...] = (),
) -> Scene:
    """Returns the scene with this name.

    Args:
        name: a key of ALL_SCENES.
        urdf: path of a URDF file or catalog name, for the scene "hold".
        tip: end-effector frame, for the scene "hold".
        urdf_text: a URDF's text, or a zip, instead of its path (uploads).
        hold: patterns of joints that are held, for the scene "hold"; see `robots.load_robot`.

    Raises:
        InputError: the scene is unknown, a scene with its own robot gets a URDF, "hold" gets no URDF, or the
            URDF is invalid.
    """
    if name not in ALL_SCENES:
        raise unknown_name("scene", name, ALL_SCENES)
    if name == "hold":
        if urdf is None and urdf_text is None:
            raise InputError("scene 'hold' needs a robot: add --urdf FILE.urdf, or choose iiwa14-hold")
        return hold_scene(urdf, tip, urdf_text, hold=hold)
    if (urdf, tip, urdf_text, hold) != (None, None, None, ()):
        raise InputError(
            f"scene '{name}' brings its own robot: use the scene 'hold' with --urdf, --tip, --tool and --hold"
        )
    return _made(name)


@lru_cache(maxsize=4)
def _made(name: str) -> Scene:
    return velocity_scene(name) if name in VELOCITY_SCENES else _MAKERS[name]()


def torque_scene(name: str, urdf: str | None = None, tip: str | None = None) -> TorqueScene:
    """Returns the torque-level scene with this name. Raises InputError also for a velocity-level scene."""
    return as_torque_scene(load_scene(name, urdf, tip), "this")


def as_torque_scene(scene: Scene, what: str) -> TorqueScene:
    """Returns the scene itself. Raises InputError if it is a velocity-level scene; the message says that
    `what` takes torques."""
    if not isinstance(scene, TorqueScene):
        raise InputError(
            f"scene '{scene.name}' is driven by velocities; {what} takes torques: choose e.g. iiwa14-hold"
        )
    return scene


def attached(scene: Scene, controllers: Iterable[str], tasks: Mapping[str, Task]) -> Scene:
    """Returns a torque-level scene with users' files attached: its controller can be one of `controllers`,
    and its stack can name `tasks` by the paths of their files. Returns other scenes unchanged."""
    if not isinstance(scene, TorqueScene):
        return scene
    settings = admitted(scene.settings, controllers)
    own = {**dict(settings.own_tasks), **tasks}
    return replace(scene, settings=replace(settings, own_tasks=tuple(own.items())))


def prepared(scene: AnyScene, controller: str | None, assignments: Iterable[str]) -> AnyScene:
    """Returns the scene with another controller (None: its own) and all assignments "PATH=VALUE", in order.

    The controller may be the path of a Python file; an assignment may name only files that are admitted.

    Raises:
        InputError: the controller is unknown or of the other kind, a path is unknown, or a value does not
            fit.
    """
    settings = scene.settings
    if controller is not None:
        if controller not in settings.controllers and controller in _COMMANDS:
            raise InputError(
                f"controller '{controller}' commands {_COMMANDS[controller]} and scene '{scene.name}' takes "
                f"{_COMMANDS[settings.controller]}: choose one of {', '.join(settings.controllers)}"
            )
        settings = admitted(settings, (controller,)).changed("controller", controller)
    return replace(scene, settings=with_assignments(settings, assignments))


def admitted(settings: AnySettings, files: Iterable[str]) -> AnySettings:
    """Returns the settings with additional Python files that can be selected as the controller. The person
    who started the program has named these files.

    Raises:
        InputError: the scene takes velocities, but a user's controller gives torques.
    """
    files = tuple(name for name in files if is_file(name))
    if not files:
        return settings
    if not isinstance(settings, TorqueSettings):
        raise InputError(
            f"a controller of your own ({files[0]}) gives torques, and this scene takes velocities: "
            "choose a scene at torque level, e.g. iiwa14-hold"
        )
    return replace(settings, files=tuple(dict.fromkeys((*settings.files, *files))))


_COMMANDS = dict.fromkeys(CONTROLLERS, "torques") | dict.fromkeys(VELOCITY_CONTROLLERS, "velocities")
