"""Torque-level and velocity-level scenes behind one set of functions: the scene's kind chooses."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from himpc.catalog import CONTROLLERS, VELOCITY_CONTROLLERS
from lessons.events import Event, MoveLevel, Set
from lessons.recording.run import parse_assignment, run, with_assignments
from lessons.recording.torque import Recording, arrays, summary
from lessons.recording.velocity import MobileRecording, mobile_arrays, mobile_summary
from lessons.recording.velocity_run import mobile_run
from lessons.scenes.catalog import load_scene
from lessons.scenes.missions import mobile_scene
from lessons.scenes.names import MOBILE_SCENES
from lessons.scenes.torque_scene import Scene
from lessons.scenes.velocity_scene import MobileScene
from lessons.session.torque import Session
from lessons.session.velocity import MobileSession
from lessons.settings.levels import moved
from lessons.settings.torque import SceneSettings, changed, paths, value_at
from lessons.settings.velocity import MobileSettings, with_obstacle
from lessons.settings.velocity import changed as changed_mobile
from lessons.settings.velocity import paths as mobile_paths
from lessons.settings.velocity import value_at as value_at_mobile
from lessons.teaching.control import Control
from lessons.velocity_events import Appear, MobileEvent
from robots import InputError

AnyScene = Scene | MobileScene
AnySession = Session | MobileSession
AnySettings = SceneSettings | MobileSettings
AnyEvent = Event | MobileEvent
AnyRecording = Recording | MobileRecording


def find_scene(
    name: str, urdf: str | None = None, tip: str | None = None, urdf_text: str | None = None
) -> AnyScene:
    """A scene of either kind by its name. Raises InputError like `load_scene`."""
    if name not in MOBILE_SCENES:
        return load_scene(name, urdf, tip, urdf_text)
    if urdf is not None or urdf_text is not None or tip is not None:
        raise InputError(f"scene '{name}' brings its own robot: use the scene 'hold' with --urdf and --tip")
    return mobile_scene(name)


def prepared(scene: AnyScene, controller: str | None, assignments: Iterable[str]) -> AnyScene:
    """The scene with another controller (None: its own) and every "PATH=VALUE", in order.

    Raises:
        InputError: unknown controller or one of the other kind, unknown path, or a value that does not fit.
    """
    if isinstance(scene, Scene):
        if controller in VELOCITY_CONTROLLERS:
            raise InputError(
                f"controller '{controller}' commands velocities and scene '{scene.name}' takes torques: "
                "choose one of the scenes ridgeback-ur10-…, iiwa14-htmpc or panda-htmpc"
            )
        settings = scene.settings if controller is None else changed(scene.settings, "controller", controller)
        return replace(scene, settings=with_assignments(settings, assignments))
    if controller in CONTROLLERS:
        raise InputError(
            f"controller '{controller}' commands torques and scene '{scene.name}' takes velocities: "
            f"choose one of {', '.join(VELOCITY_CONTROLLERS)}"
        )
    mobile = scene.settings
    for path, value in _assigned(controller, assignments):
        mobile = changed_mobile(mobile, path, value)
    return replace(scene, settings=mobile)


def changed_any(settings: AnySettings, path: str, value: Any) -> AnySettings:
    """The settings of either kind with the value at a path replaced. Raises InputError like `changed`."""
    if isinstance(settings, SceneSettings):
        return changed(settings, path, value)
    return changed_mobile(settings, path, value)


def settings_after(settings: AnySettings, events: Iterable[AnyEvent]) -> AnySettings:
    """The settings that events leave behind when the run is reset.

    Args:
        settings: before.
        events: that took effect, in order. Most change the run alone, which a reset undoes.
    """
    for event in events:
        match event:
            case Set(path, value):
                settings = changed_any(settings, path, value)
            case MoveLevel(name, to) if isinstance(settings, SceneSettings):
                settings = replace(settings, levels=moved(settings.levels, name, to))
            case Appear() if isinstance(settings, MobileSettings):
                settings = with_obstacle(settings, event.ball())
            case _:
                pass
    return settings


def paths_of(scene: AnyScene) -> list[str]:
    """Every path that `prepared` takes for a scene."""
    return paths(scene.settings) if isinstance(scene, Scene) else mobile_paths(scene.settings)


def _assigned(controller: str | None, assignments: Iterable[str]) -> list[tuple[str, Any]]:
    chosen = [] if controller is None else [("controller", controller)]
    return [*chosen, *map(parse_assignment, assignments)]


def run_scene(
    scene: AnyScene,
    duration: float | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    to_the_end: bool = False,
) -> AnyRecording:
    """Runs a scene headless; see `run` and `mobile_run`."""
    if isinstance(scene, Scene):
        return run(scene, duration, seed, progress, to_the_end)
    return mobile_run(scene, duration, seed, progress, to_the_end)


def summary_of(recording: AnyRecording) -> dict[str, Any]:
    """The object of `himpc-lab run --json`."""
    return summary(recording) if isinstance(recording, Recording) else mobile_summary(recording)


def arrays_of(recording: AnyRecording, how: dict[str, Any]) -> dict[str, Any]:
    """The arrays of `himpc-lab run --npz`; see `lessons.recording.torque.arrays`."""
    if isinstance(recording, Recording):
        return arrays(recording, how)
    return mobile_arrays(recording, how)


def session_of(scene: AnyScene, seed: int) -> AnySession:
    """A scene from its beginning. Raises InputError if its settings do not fit its robot."""
    return Session(scene, seed) if isinstance(scene, Scene) else MobileSession(scene, seed)


def mission_over(session: AnySession) -> bool:
    """Whether there is nothing left to do, which ends a headless run."""
    return isinstance(session, MobileSession) and session.progress.done


def setting_at(settings: AnySettings, path: str) -> Any:
    """The value at a path of a lesson's control; of a weight of all levels the first one's."""
    if path in ("Q", "R"):
        return getattr(settings.levels[0], path)
    if isinstance(settings, SceneSettings):
        return value_at(settings, path)
    return value_at_mobile(settings, path)


def chosen(settings: AnySettings, control: Control) -> Any:
    """Which of a control's choices the settings have: the one that would change nothing; None if none is."""
    fitting = (each for each in control.choices if changed_any(settings, control.path, each) == settings)
    return next(fitting, None)


def within(settings: AnySettings, control: Control) -> bool:
    """Whether a setting stands where its control could have put it."""
    if control.choices:
        return chosen(settings, control) is not None
    return control.takes(setting_at(settings, control.path))
