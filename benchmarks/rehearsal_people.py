"""The pages of the rehearsal: learners and their teacher, see `benchmarks.rehearsal`."""

from __future__ import annotations

import contextlib
import json
import threading
import time
from collections.abc import Callable
from typing import Any

from websockets.sync.client import connect

from app.panels.widgets.in_view import AWAKE, LABEL
from browsing.wire import Wire

LONG = 300.0  # s


class Learner(Wire):
    """A learner's page."""

    def _take(self, message: dict[str, Any]) -> None:
        if message["type"] == "ResetGuiMessage":
            self.controls.clear()
        super()._take(message)
        if message["type"] == "GuiTextMessage" and message["props"]["label"] == LABEL:
            self.write(message["uuid"], value=AWAKE)  # a browser shows only the curves of the step

    def waits_for(self, condition: Callable[[], object]) -> float:
        """Returns the time until a condition holds, s."""
        began = time.monotonic()
        while True:
            with contextlib.suppress(RuntimeError):  # the page changes while it is read
                if condition():
                    return time.monotonic() - began
            if time.monotonic() - began > LONG:
                raise TimeoutError("a learner waits for too long")
            time.sleep(0.02)

    def use(self, label: str, value: object) -> None:
        """Uses the control with this label, as soon as the page has it."""
        self.waits_for(lambda: self.find(label))
        found = self.find(label)
        assert found is not None
        self.write(found, value=value)


class Teacher:
    """A teacher's page. told: the latest value of each part that the page shows."""

    def __init__(self, link: str) -> None:
        self._line = connect(link.replace("http", "ws", 1), max_size=None, ping_interval=None)
        self.told: dict[str, Any] = {}
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.send(do="here", address="")

    def _read(self) -> None:
        with contextlib.suppress(Exception):
            for text in self._line:
                self.told |= json.loads(text)

    def send(self, **message: object) -> None:
        """Presses a button."""
        self._line.send(json.dumps(message))

    def close(self) -> None:
        """Closes the page."""
        self._line.close()
        self._reader.join(5.0)
