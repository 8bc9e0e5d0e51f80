"""The scenes by name."""

from __future__ import annotations

from collections.abc import Callable

from lessons.scenes.circle import iiwa14_circle, iiwa14_circle_paper
from lessons.scenes.hold import hold, hold_of
from lessons.scenes.mobile_hold import ridgeback_hold
from lessons.scenes.names import MOBILE_SCENES, SCENES
from lessons.scenes.planar import planar3_circle, planar3_conflict, planar3_singular
from lessons.scenes.torque_scene import Scene
from robots import InputError
from robots.errors import unknown_name

_MAKERS: dict[str, Callable[[], Scene]] = {
    "iiwa14-hold": lambda: hold_of("iiwa14"),
    "panda-hold": lambda: hold_of("panda"),
    "planar3-hold": lambda: hold_of("planar3"),
    "ridgeback-ur10-hold": ridgeback_hold,
    "planar3-circle": planar3_circle,
    "planar3-conflict": planar3_conflict,
    "planar3-singular": planar3_singular,
    "iiwa14-circle": iiwa14_circle,
    "iiwa14-circle-paper": iiwa14_circle_paper,
}


def load_scene(
    name: str, urdf: str | None = None, tip: str | None = None, urdf_text: str | None = None
) -> Scene:
    """A scene by its name.

    Args:
        name: a key of SCENES.
        urdf: path of a URDF file or catalog name, for the scene "hold".
        tip: end-effector frame, for the scene "hold".
        urdf_text: a URDF's text instead of its path (uploads).

    Raises:
        InputError: unknown scene, a URDF where none fits or none where one is needed, or a bad one.
    """
    if name in MOBILE_SCENES:
        raise InputError(
            f"scene '{name}' is driven by velocities; this takes torques: choose e.g. iiwa14-hold"
        )
    if name not in SCENES:
        raise unknown_name("scene", name, (*SCENES, *MOBILE_SCENES))
    if name == "hold":
        if urdf is None and urdf_text is None:
            raise InputError("scene 'hold' needs a robot: add --urdf FILE.urdf, or take iiwa14-hold")
        return hold(urdf, tip, urdf_text)
    if urdf is not None or urdf_text is not None or tip is not None:
        raise InputError(f"scene '{name}' brings its own robot: use the scene 'hold' with --urdf and --tip")
    return _MAKERS[name]()
