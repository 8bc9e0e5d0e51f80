"""Running a scene headless, as fast as it goes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lessons.recording.torque import Recording
from lessons.scenes.torque_scene import Scene
from lessons.session.torque import Session
from lessons.settings.torque import SceneSettings, changed
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
    except RecursionError:
        raise InputError(f"--set {path}: the list is nested too deeply; give a number or a list") from None
    except InputError:
        raise
    except ValueError:
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
    to_the_end: bool = False,
) -> Recording:
    """Runs a scene from its start.

    Args:
        scene: what to run.
        duration: simulated seconds; None: the scene's own.
        seed: seed of the run.
        progress: called now and then with the share that is done.
        to_the_end: go on after control was lost, as the page does; otherwise the run ends there.

    Returns:
        the rows.
    """
    seconds = checked_duration(scene.duration if duration is None else duration)
    session = Session(scene, seed)

    def ended() -> bool:
        return session.diverged_at is not None and not to_the_end

    rows, wall_s = repeated(session.tick, lambda: session.settings.T_s, seconds, ended, progress)
    return Recording(session, rows, wall_s)


def checked_duration(seconds: float) -> float:
    """The same number. Raises InputError if nobody can wait that long."""
    if not 0 < seconds <= 3600:
        raise InputError(f"--duration is {seconds} s: give a time above 0 and at most 3600")
    return seconds


def repeated(
    tick: Callable[[], Array],
    period: Callable[[], float],
    seconds: float,
    ended: Callable[[], bool],
    progress: Callable[[float], None] | None = None,
) -> tuple[list[Array], float]:
    """Ticks for so many simulated seconds, at least once.

    Args:
        tick: one control period; its row is a buffer.
        period: s, the period in force: it may change on the way.
        seconds: how long.
        ended: whether the run ends by itself.
        progress: called now and then with the share that is done.

    Returns:
        copies of the rows, and the wall time in s.
    """
    rows: list[Array] = []
    elapsed = 0.0
    started = perf_counter()
    # Half a period's tolerance: a sum of periods carries rounding.
    while not rows or elapsed < seconds - 0.5 * period():
        rows.append(tick().copy())
        elapsed += period()
        if ended():
            break
        if progress is not None and len(rows) % 200 == 1:
            progress(elapsed / seconds)
    return rows, perf_counter() - started
