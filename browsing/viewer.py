"""A page without a browser that reports the charts of one tab as visible, and counts what it receives."""

from __future__ import annotations

import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from app.tab.in_view import ASLEEP, AWAKE, LABEL
from browsing.tab import Storage, Tab

CURVES = "Joints"
"""The tab with the most curves."""


@dataclass
class Second:
    """The messages of one second. plots, links: how often each chart and each node of the scene was
    updated."""

    bytes: int = 0
    messages: int = 0
    plots: Counter[str] = field(default_factory=Counter)
    links: Counter[str] = field(default_factory=Counter)

    def rates(self, seconds: float) -> dict[str, float]:
        """Returns the rates per second."""
        return {
            "megabytes_per_s": 1e-6 * self.bytes / seconds,
            "messages_hz": self.messages / seconds,
            "plots_hz": max(self.plots.values(), default=0) / seconds,
            "poses_hz": max(self.links.values(), default=0) / seconds,
        }


class Viewer(Tab):
    """A page whose learner looks at one tab.

    Attributes:
        tab: the tab whose charts are visible; None if the whole page is in the background.
        second: the messages received so far; the reader replaces it.
        reads: while this is not set, nothing more is read from the line.
    """

    def __init__(
        self, url: str, storage: Storage | None = None, tab: str | None = CURVES, *, delay: float = 0.0,
        slow: bool = False,
    ) -> None:  # fmt: skip
        """delay: time before each packet, s."""
        self.tab, self._delay = tab, delay
        self.second, self.reads = Second(), threading.Event()
        self.reads.set()
        self._said = ("", "")
        super().__init__(url, storage or Storage(), slow or delay > 0.0)

    def __exit__(self, *_: object) -> None:
        self.reads.set()
        super().__exit__()

    @property
    def drawn(self) -> set[str]:
        """The titles of the charts that were updated in the present `second`."""
        charts = (self.controls.get(uuid) for uuid in list(self.second.plots))
        return {each["props"]["title"] for each in charts if each is not None}

    @property
    def moves(self) -> bool:
        """Whether a plot and a node of the scene were updated in the present `second`."""
        return bool(self.second.plots and self.second.links)

    def _hear(self, raw: bytes) -> None:
        time.sleep(self._delay)
        self.reads.wait()
        self.second.bytes += len(raw)
        super()._hear(raw)
        self._tell_what_is_seen()

    def _take(self, message: dict[str, Any]) -> None:
        super()._take(message)
        self.second.messages += 1
        match message["type"]:
            case "GuiUpdateMessage" if "data" in message["updates"]:
                self.second.plots[message["uuid"]] += 1
            case "SetPositionMessage" | "SetOrientationMessage":
                self.second.links[f"{message['type']} {message.get('name')}"] += 1
            case _:
                pass

    def _tell_what_is_seen(self) -> None:
        control = self.find(LABEL)
        seen = ASLEEP if self.tab is None else "\n".join([AWAKE, *sorted(self._visible())])
        if control is not None and (control, seen) != self._said:
            self._said = (control, seen)
            self.write(control, value=seen)

    def _visible(self) -> list[str]:
        """Returns the titles of the charts of the tab, and of those outside of all tabs."""
        tabs: dict[str, str] = {}
        for each in self.controls.values():
            if each["type"] in ("GuiPanelMessage", "GuiTabGroupMessage"):
                props = each["props"]
                tabs |= zip(props["_tab_container_ids"], props["_tab_labels"], strict=True)
        found = []
        for each in self.controls.values():
            if each["type"] == "GuiUplotMessage":
                title, place = each["props"]["title"], each["container_uuid"]
                while place in self.controls:
                    place = self.controls[place]["container_uuid"]
                if tabs.get(place, self.tab) == self.tab:
                    found.append(title)
        return found
