"""The deadline of the torque, the settings of the computing time, and the share of late ticks."""

from __future__ import annotations

from collections import deque

import viser

from app.html.text import block
from app.panels.widgets.controls import Controls
from app.panels.widgets.snapshot import SessionSnapshot
from lessons.settings.torque import TorqueSettings

_LOOKS = 9
"""Number of updates over which the share of late ticks is computed: about two seconds."""


class DeadlineFolder:
    """Two sliders, and a line with the share of late ticks."""

    def __init__(self, gui: viser.GuiApi, controls: Controls[TorqueSettings]) -> None:
        with gui.add_folder("Deadline"):
            controls.add("deadline_ms", "solve_ms_per_knot")
            self._line = gui.add_html("")
        self._counts: deque[tuple[int, int]] = deque(maxlen=_LOOKS)

    def update(self, now: SessionSnapshot[TorqueSettings]) -> None:
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
            text = "Late torques: no tick counted yet."
        else:
            text = f"Late torques: <b>{(late - first_late) / ran:.0%}</b> of the last {ran} ticks."
        self._line.content = block(text)
