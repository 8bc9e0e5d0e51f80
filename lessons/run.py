"""Running a scene headless, as fast as it goes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from time import perf_counter
from typing import Any

from lessons.scene import Scene
from lessons.session import Session
from lessons.settings import SceneSettings, changed
from lessons.summary import Recording
from robots import InputError


def parse_assignment(text: str) -> tuple[str, Any]:
    """("horizon", 10) from "horizon=10". Values are JSON (numbers, true, lists) or plain words.

    Raises:
        InputError: there is no "=", or the value is NaN or infinite.
    """
    path, equals, value = text.partition("=")
    if not equals or not path:
        raise InputError(f"--set {text}: write it as PATH=VALUE, e.g. --set horizon=10")
    try:
        return path, json.loads(value, parse_constant=_refuse_constant(text))
    except json.JSONDecodeError:
        if value.lower() in ("nan", "inf", "-inf", "infinity", ""):
            raise InputError(
                f"--set {text}: '{value}' is no finite number; give one, e.g. {path}=1"
            ) from None
        return path, value


def _refuse_constant(text: str) -> Callable[[str], Any]:
    def refuse(constant: str) -> Any:
        raise InputError(f"--set {text}: {constant} is no finite number; give one")

    return refuse


def with_assignments(settings: SceneSettings, assignments: Iterable[str]) -> SceneSettings:
    """The settings after every "PATH=VALUE", in order. Raises InputError like `changed`."""
    for text in assignments:
        settings = changed(settings, *parse_assignment(text))
    return settings


def run(
    scene: Scene,
    duration: float | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Runs a scene from its start.

    Args:
        scene: what to run.
        duration: simulated seconds; None: the scene's own.
        seed: seed of the run.
        progress: called now and then with the share that is done.

    Returns:
        the rows. A run that loses control ends there.
    """
    seconds = scene.duration if duration is None else duration
    if not 0 < seconds <= 3600:
        raise InputError(f"--duration is {seconds} s: give a time above 0 and at most 3600")
    session = Session(scene, seed)
    ticks = max(1, round(seconds / session.settings.T_s))
    rows = []
    started = perf_counter()
    for k in range(ticks):
        rows.append(session.tick().copy())
        if session.diverged_at is not None:
            break
        if progress is not None and k % 200 == 0:
            progress(k / ticks)
    return Recording(session, rows, perf_counter() - started)
