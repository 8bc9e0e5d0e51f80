"""A slider over the last minute, for looking back while paused. The slider is above the tabs and visible
whenever it can be used."""

from __future__ import annotations

import math
from functools import partial

import viser

from app.adapter.removed_handle_errors import unless_removed
from app.html.text import block
from app.panels.context import PageContext
from app.panels.widgets.command import add_command, on_click

_STEP = 0.05  # s
_SHORT, _LONG = 0.1, 1.0  # s per key press
_LEAST = 0.2  # s: the slider is shown only if the history is longer than this


class TimeLine:
    """The time line. `past` is the past moment that is shown, or None for the present. When simulated time
    continues (run, step or reset), the view returns to the present."""

    def __init__(self, page: PageContext) -> None:
        gui, self._learner, self._loop = page.gui, page.learner, page.loop
        self.past: float | None = None
        self._paused_at: float | None = None  # s, simulated time at which the run is paused
        self._closed = False
        self._slider = gui.add_slider(
            "Look back [s]",
            min=-_LEAST,
            max=0.0,
            step=_STEP,
            initial_value=0.0,
            visible=False,
            hint="Shows robot, targets, traces and plots at an earlier time, up to a minute ago. "
            f"J and K: {_SHORT:g} s, with Shift {_LONG:g} s; in the slider also ← and →.",
        )
        self._live = gui.add_button("Back to now", visible=False)
        self._words = gui.add_html("", visible=False)

        @self._slider.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client is not None:
                self._look(float(self._slider.value))

        on_click(self._live, lambda: self._set(0.0))

        for words, key, shift, seconds in (
            ("Look back a little", "J", False, -_SHORT),
            ("Look forward a little", "K", False, _SHORT),
            ("Look back a second", "J", True, -_LONG),
            ("Look forward a second", "K", True, _LONG),
        ):
            add_command(gui, words, key, partial(self._shift, seconds), shift)

    def _shift(self, seconds: float) -> None:
        if self._paused_at is not None:
            self._set(float(self._slider.value) + seconds)

    def _set(self, ago: float) -> None:
        if not self._closed:
            self._slider.value = round(min(0.0, max(float(self._slider.min), ago)), 3)
            self._look(float(self._slider.value))

    def _look(self, ago: float) -> None:
        """Chooses the moment that is shown. ago: its time relative to the pause, s, ≤ 0."""
        at = self._paused_at
        self.past = None if at is None or ago > -0.5 * _STEP else at + ago

    def update(self, running: bool) -> None:
        """Shows or hides the slider; called for every frame, before the page reads `past`."""
        first, last = self._learner.tape.span
        if running or last - first < _LEAST:
            if self._paused_at is not None:
                self._leave()
        elif self._paused_at != last:
            self._enter(first, last)
        self._say()

    def _enter(self, first: float, last: float) -> None:
        self.past, self._paused_at = None, last
        self._slider.min = round(-math.floor((last - first) / _STEP) * _STEP, 3)
        self._loop.call_soon_threadsafe(unless_removed, self._set, 0.0)
        self._slider.visible = True

    def _leave(self) -> None:
        self.past = self._paused_at = None
        self._slider.visible = False
        self._loop.call_soon_threadsafe(unless_removed, self._set, 0.0)

    def _say(self) -> None:
        past, at = self.past, self._paused_at
        looking = past is not None and at is not None
        if self._live.visible != looking:
            self._live.visible = self._words.visible = looking
        if past is not None and at is not None:
            text = block(f"<b>Looking back</b>: t = {past:.2f} s, {at - past:.2f} s before the pause")
            if self._words.content != text:
                self._words.content = text

    def close(self) -> None:
        self._closed = True
