"""When a torque is due, what decides how long it took, and how often it comes too late."""

from __future__ import annotations

from collections import deque

import viser

from app.html.text import block
from app.panels.widgets.mirror import Bindings
from app.panels.widgets.snapshot import Snapshot
from lessons.events import Set
from lessons.settings.torque import TorqueSettings

_LOOKS = 9
"""Looks at the counters over which the share of late ticks is taken: about two seconds."""


class DeadlineFolder:
    """Two sliders and one line."""

    def __init__(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings
    ) -> None:
        with gui.add_folder("Deadline"):
            deadline = gui.add_slider(
                "Due after [ms]",
                min=0.0,
                max=max(5.0, settings.deadline_ms),
                step=0.1,
                initial_value=settings.deadline_ms,
                hint="A torque that is found later acts one tick later; until then the one before is held. "
                "0: lockstep, time stands still while the controller computes",
            )
            with gui.add_folder(None):
                per_knot = gui.add_slider(
                    "Per knot [ms]",
                    min=0.0,
                    max=max(0.5, settings.solve_ms_per_knot),
                    step=0.01,
                    initial_value=settings.solve_ms_per_knot,
                    hint="What the computer is assumed to take, times N. 0: what this one really takes",
                )
            self._line = gui.add_html("")
        self._counts: deque[tuple[int, int]] = deque(maxlen=_LOOKS)
        bindings.bind(
            deadline, lambda s: float(s.deadline_ms), lambda value: Set("deadline_ms", float(value))
        )
        bindings.bind(
            per_knot,
            lambda s: float(s.solve_ms_per_knot),
            lambda value: Set("solve_ms_per_knot", float(value)),
        )

    def update(self, now: Snapshot[TorqueSettings]) -> None:
        ticks, late = now.status.ticks, now.status.late
        if self._counts and ticks < self._counts[-1][0]:
            self._counts.clear()
        if not self._counts or ticks > self._counts[-1][0]:
            self._counts.append((ticks, late))
        first_ticks, first_late = self._counts[0]
        ran = ticks - first_ticks
        if now.settings.deadline_ms == 0:
            text = "Lockstep: no torque is ever late."
        elif ran == 0:
            text = "Late torques: none counted yet."
        else:
            text = f"Late torques: <b>{(late - first_late) / ran:.0%}</b> of the last {ran} ticks."
        self._line.content = block(text)
