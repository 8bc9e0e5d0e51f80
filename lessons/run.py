"""Running a scene headless, as fast as it goes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lessons.scene import Scene
from lessons.session import Session
from lessons.settings import SceneSettings, changed
from lessons.summary import Recording
from robots import InputError

Array = NDArray[np.float64]


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
    seconds = checked_duration(scene.duration if duration is None else duration)
    session = Session(scene, seed)
    ticks = max(1, round(seconds / session.settings.T_s))
    rows, wall_s = repeated(session.tick, ticks, lambda: session.diverged_at is not None, progress)
    return Recording(session, rows, wall_s)


def checked_duration(seconds: float) -> float:
    """The same number. Raises InputError if nobody can wait that long."""
    if not 0 < seconds <= 3600:
        raise InputError(f"--duration is {seconds} s: give a time above 0 and at most 3600")
    return seconds


def repeated(
    tick: Callable[[], Array],
    ticks: int,
    ended: Callable[[], bool],
    progress: Callable[[float], None] | None = None,
) -> tuple[list[Array], float]:
    """Copies of the rows of so many ticks, fewer if the run ends by itself, and the wall time in s."""
    rows = []
    started = perf_counter()
    for k in range(ticks):
        rows.append(tick().copy())
        if ended():
            break
        if progress is not None and k % 200 == 0:
            progress(k / ticks)
    return rows, perf_counter() - started
