"""Controls for run, pause, step, speed and reset, and the real-time factor. They are always visible above the
tabs."""

from __future__ import annotations

import math
import time
from contextlib import nullcontext
from functools import partial

import viser

from app.adapter.removed_handle_errors import unless_removed
from app.client.pending_edit import HOLD, PendingEdit
from app.client.simulation import Trouble
from app.html.palette import LEVELS, ink
from app.html.text import block, esc, in_trouble
from app.link.messages import Play, Post, Speed, Status, StepTicks
from app.panels.context import PageContext
from app.panels.widgets.command import add_command, on_click
from app.panels.widgets.snapshot import SessionSnapshot
from lessons.events import Reset
from lessons.settings.settings import SceneSettings

_PAUSE, _RUN, _STEP, _RESET, _RESET_ALL = "Pause", "Run", "Step", "Reset", "Reset all"


_KEPT = 0.9
"""The share of the speed that was set with which simulated time counts as on time."""


class PlaybackPanel:
    """Buttons and a status line."""

    def __init__(
        self,
        page: PageContext,
        fastest: float,
        brief: bool,
    ) -> None:
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

        @self._speed.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client is not None:
                self._touched = time.monotonic()
                page.send(Speed(float(self._speed.value)))

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
            learner.send(StepTicks())
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
        if self._buttons.options != choices:
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
