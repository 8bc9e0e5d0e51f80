"""Controls that mirror the session's settings."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import viser

from lessons.events import Event
from lessons.settings import SceneSettings

HOLD = 0.8
"""s during which a control that was just touched is not overwritten: the session's answer is on its way."""

Post = Callable[[Event], None]


@dataclass
class _Mirror:
    handle: viser.GuiInputHandle[Any]
    read: Callable[[SceneSettings], Any]
    touched: float = -float("inf")
    ticks: int = -1  # when it was touched: a paused session answers with its next tick


class Bindings:
    """Two ways: a control posts an event, and settings that changed otherwise (a reset, a hotkey, an event
    that was refused) move the control. Callbacks only post: they never touch the simulation."""

    def __init__(self, post: Post) -> None:
        self.post = post
        self._mirrors: list[_Mirror] = []
        self._ticks = 0

    def bind(
        self,
        handle: viser.GuiInputHandle[Any],
        read: Callable[[SceneSettings], Any],
        event: Callable[[Any], Event],
    ) -> None:
        """`read` gives the control's value for some settings, `event` the event for a value."""
        mirror = _Mirror(handle, read)
        self._mirrors.append(mirror)

        @handle.on_update
        async def _(change: viser.GuiEvent[Any]) -> None:
            if change.client is None:
                return  # written by `refresh`
            mirror.touched, mirror.ticks = time.monotonic(), self._ticks
            self.post(event(handle.value))

    def refresh(self, settings: SceneSettings, ticks: int) -> None:
        """Shows what the session has after so many ticks."""
        now, self._ticks = time.monotonic(), ticks
        for mirror in self._mirrors:
            if now - mirror.touched > HOLD and ticks != mirror.ticks:
                value = mirror.read(settings)
                if value != mirror.handle.value:
                    mirror.handle.value = value


def scalar(value: object) -> float:
    """A number for a slider where settings may hold one per coordinate: their mean."""
    if isinstance(value, (tuple, list)):
        return float(sum(value) / len(value))
    return float(value)  # pyright: ignore[reportArgumentType]
