"""Runs a scene headless, as fast as possible."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any, final

import numpy as np

from himpc.telemetry import Layout, relaid
from lessons.scenes.scene import Scene
from lessons.session.session import Session
from lessons.session.start import begin
from robots import InputError
from robots.arrays import Array


@final
class Recording:
    """The rows of one run, one per control tick, and how long the run took in wall time."""

    def __init__(self, session: Session, rows: Sequence[Array], wall_s: float) -> None:
        # Attributes that only one kind of session has are used only by code for that kind.
        self.session: Any = session
        self.layout: Layout = session.layout
        self.rows = np.array(rows).reshape(len(rows), session.layout.size)
        self.wall_s = wall_s

    def __getitem__(self, field: str) -> Array:
        """Returns a field over time, (ticks, width)."""
        return self.rows[:, self.layout.fields[field]]

    @property
    def duration(self) -> float:
        """Simulated seconds."""
        return len(self.rows) * self.session.settings.T_s


def run(
    scene: Scene,
    duration: float | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    to_the_end: bool = False,
) -> Recording:
    """Runs a scene from its start to the end of its mission, if it has one, or for its duration.

    Args:
        scene: the scene.
        duration: simulated seconds at most; None: the scene's own.
        seed: seed of the run.
        progress: called from time to time with the completed share.
        to_the_end: whether to continue after the mission is completed or control was lost, as the page does;
            otherwise the run ends there.

    Returns:
        the rows.

    Raises:
        InputError: the settings or the duration are invalid, or a user's controller failed.
    """
    seconds = checked_duration(scene.duration if duration is None else duration)
    return record(begin(scene, seed), seconds, progress, to_the_end)


def record(
    session: Session,
    seconds: float,
    progress: Callable[[float], None] | None = None,
    to_the_end: bool = False,
) -> Recording:
    """As `run`, for a session that has already begun."""
    rows, elapsed, started = [], 0.0, perf_counter()
    layout = session.layout
    # Half a period of tolerance: a sum of periods contains rounding errors.
    while not rows or elapsed < seconds - 0.5 * session.settings.T_s:
        row = session.tick().copy()
        if session.layout is not layout:  # an event changed the stack
            before = np.array(rows).reshape(len(rows), layout.size)
            rows, layout = list(relaid(before, layout, session.layout)), session.layout
        rows.append(row)
        elapsed += session.settings.T_s
        if session.failure is not None:
            raise InputError(session.failure)
        if (session.diverged_at is not None or session.over) and not to_the_end:
            break
        if progress is not None and len(rows) % 200 == 1:
            progress(elapsed / seconds)
    return Recording(session, rows, perf_counter() - started)


def checked_duration(seconds: float) -> float:
    """Returns the number. Raises InputError unless it is above 0 and at most 3600."""
    if not 0 < seconds <= 3600:
        raise InputError(f"--duration is {seconds} s: give a time above 0 and at most 3600")
    return seconds
