"""Run, pause, step, speed and reset, with the real-time factor, and a slider for looking back while paused.
They are always visible above the tabs."""

from __future__ import annotations

import math
import time
from contextlib import nullcontext
from functools import partial

from app.adapter.private import unless_removed
from app.client.simulation import Trouble
from app.html.palette import LEVELS, ink
from app.html.text import block, esc, in_trouble
from app.link.messages import Play, Post, Speed, Status, StepTick
from app.panels.widgets.command import add_command, on_change, on_click
from app.tab.context import PageContext, SessionSnapshot
from app.tab.mirror import HOLD, PendingEdit
from lessons.events import Reset
from lessons.settings.settings import SceneSettings

_PAUSE, _RUN, _STEP, _RESET, _RESET_ALL = "Pause", "Run", "Step", "Reset", "Reset all"


_KEPT = 0.9
"""The share of the speed that was set with which simulated time counts as on time."""


class PlaybackPanel:
    """Buttons and a status line."""

    def __init__(self, page: PageContext, fastest: float, brief: bool) -> None:
        """fastest: the highest selectable speed, simulated seconds per second; brief: whether the controls
        that a lesson does not need are folded."""
        gui, self._learner, self._loop = page.gui, page.learner, page.loop
        self._running: PendingEdit[bool] = PendingEdit()
        self._closed, self._brief = False, brief
        self._trouble = gui.add_html("", visible=False)
        self._again = gui.add_button("Start again", visible=False)
        self._status = gui.add_html(block("Starting the simulation …"))
        self._buttons = gui.add_button_group(
            "Playback",
            self._choices(True),
            hint="Space: run or pause · T: one control tick · R: robot back to its start. "
            "Reset all also restores every setting.",
        )
        with gui.add_folder("Time", expand_by_default=False) if brief else nullcontext():
            self._speed = gui.add_slider(
                "Speed",
                min=0.1,
                max=fastest,
                step=0.1,
                initial_value=1.0,
                hint="Simulated seconds per second",
            )
            if brief:
                seldom = gui.add_button_group("Also", (_STEP, _RESET_ALL))
                on_click(seldom, lambda: self._click(str(seldom.value)))
        self._touched = -math.inf

        on_click(self._buttons, lambda: self._click(str(self._buttons.value)))
        self._again.on_click(lambda _: page.learner.restart())  # on a thread, as it starts a process

        def choose_speed() -> None:
            self._touched = time.monotonic()
            page.send(Speed(float(self._speed.value)))

        on_change(self._speed, choose_speed)

        for label, key, choice in (
            ("Run or pause", "space", _RUN),
            ("Reset the robot", "R", _RESET),
            ("Single control tick", "T", _STEP),
        ):
            add_command(gui, label, key, partial(self._click, choice))

    def _choices(self, running: bool) -> tuple[str, ...]:
        first = _PAUSE if running else _RUN
        return (first, _RESET) if self._brief else (first, _STEP, _RESET, _RESET_ALL)

    def _click(self, choice: str) -> None:
        learner = self._learner
        if choice in (_PAUSE, _RUN):
            running = self._running.now(learner.status is not None and learner.status.running)
            learner.send(Play(self._running.ask(not running)))
        elif choice == _STEP:
            self._running.ask(False)
            learner.send(StepTick())
        elif choice == _RESET and learner.trouble() is None:
            learner.send(Post(Reset()))
        else:
            self._running.ask(True)
            learner.reset_all()

    def show_trouble(self, trouble: Trouble | None) -> None:
        """Shows the problem of a simulation that stopped, hangs or takes long; None removes the message."""
        self._trouble.visible = trouble is not None
        self._again.visible = trouble is not None and trouble.offer is not None
        if trouble is None:
            return
        self._trouble.content = in_trouble(trouble.state, trouble.sentence)
        self._again.label = trouble.offer or ""
        if trouble.state == "STOPPED":
            self._status.content = block("No simulation is running.")

    def close(self) -> None:
        self._closed = True

    def _show_speed(self, speed: float) -> None:
        # This method runs on the event loop, for the reason that `Bindings` explains.
        if not self._closed and time.monotonic() - self._touched > HOLD and self._speed.value != speed:
            self._speed.value = speed

    def update(self, now: SessionSnapshot[SceneSettings]) -> None:
        status = now.status
        choices = self._choices(status.running)
        self._buttons.options = choices
        self._loop.call_soon_threadsafe(unless_removed, self._show_speed, status.speed)
        self._status.content = headline(status, now.settings.T_s)


def headline(status: Status, T_s: float) -> str:
    """Returns the line that says whether the simulation runs, the simulated time, and its speed. Its tooltip
    has the ticks and how many of them took longer than T_s, s."""
    share, many = 100 * status.over_budget / max(status.ticks, 1), status.over_budget != 1
    told = (
        f"tick {status.ticks} at t = {status.t:.3f} s; {status.over_budget} tick{'s' * many} over the "
        f"{1e3 * T_s:g} ms budget ({share:.1f} %)"
    )
    words = [f"<b>{'Running' if status.running else 'Paused'}</b>"]
    words.append(f"{status.t:.1f} s" if status.running else f"{status.t:.3f} s")
    if status.running:
        words.append(_pace(status.real_time_factor, status.speed, status.capped))
    return block(f'<span title="{esc(told)}" tabindex="0">{" &nbsp;·&nbsp; ".join(words)}</span>')


def _pace(factor: float, speed: float, capped: bool) -> str:
    """Returns the speed of simulated time. It is only a complaint if the computer cannot keep up with the
    speed that was set."""
    if capped and factor < _KEPT * min(speed, 1.0):
        why = "This computer cannot keep up: simulated time runs slower, no control tick is skipped."
        words = f"slower than real time ({factor:.1g} ×)"
        return f'<span title="{why}" style="color:{ink(LEVELS[0])}">{words}</span>'
    return "real time" if abs(factor - 1.0) < 1.0 - _KEPT else f"{factor:.1f} × real time"


_SLIDER_STEP = 0.05  # s
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
            step=_SLIDER_STEP,
            initial_value=0.0,
            visible=False,
            hint="Shows robot, targets, traces and plots at an earlier time, up to a minute ago. "
            f"J and K: {_SHORT:g} s, with Shift {_LONG:g} s; in the slider also ← and →.",
        )
        self._live = gui.add_button("Back to now", visible=False)
        self._words = gui.add_html("", visible=False)

        on_change(self._slider, lambda: self._look(float(self._slider.value)))
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
        self.past = None if at is None or ago > -0.5 * _SLIDER_STEP else at + ago

    def update(self, running: bool) -> None:
        """Shows or hides the slider; called for every frame, before the page reads `past`."""
        first, last = self._learner.read(lambda recording: recording.span) or (0.0, 0.0)
        if running or last - first < _LEAST:
            if self._paused_at is not None:
                self._leave()
        elif self._paused_at != last:
            self._enter(first, last)
        self._say()

    def _enter(self, first: float, last: float) -> None:
        self.past, self._paused_at = None, last
        self._slider.min = round(-math.floor((last - first) / _SLIDER_STEP) * _SLIDER_STEP, 3)
        self._loop.call_soon_threadsafe(unless_removed, self._set, 0.0)
        self._slider.visible = True

    def _leave(self) -> None:
        self.past = self._paused_at = None
        self._slider.visible = False
        self._loop.call_soon_threadsafe(unless_removed, self._set, 0.0)

    def _say(self) -> None:
        past, at = self.past, self._paused_at
        looking = past is not None and at is not None
        self._live.visible = self._words.visible = looking
        if past is not None and at is not None:
            text = block(f"<b>Looking back</b>: t = {past:.2f} s, {at - past:.2f} s before the pause")
            self._words.content = text

    def close(self) -> None:
        self._closed = True
