"""Clients that use the page's protocol and draw nothing: they receive and decode every message.

    python -m benchmarks.client URL [--clients K] [--tab TAB] [--delay SECONDS]

Each client answers the page's requests (camera, local storage) and reports that it shows the plots of one
tab. The program prints a line of JSON per second and client: the messages, the megabytes, and how often the
busiest plot and the busiest node of the scene were updated. With --delay, a client waits this long before
each packet, as on a slow connection. A number on stdin lets the first client reload its page that many times.
Each time, the client waits until it sees its robot; after the last reload it prints a line.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from queue import SimpleQueue
from socket import SO_RCVBUF, SOL_SOCKET, socket
from typing import Any
from urllib.parse import urlsplit

from viser import __version__, _messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from app.panels.widgets.in_view import ASLEEP, AWAKE, LABEL
from browsing.wire import camera, messages_of, pack

PATIENCE = 60.0
"""Time, s, within which a robot must appear."""
_TAB = "Joints"  # the tab with the most curves


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


class Viewer:
    """One browser. Its storage is kept when a connection ends."""

    def __init__(self, url: str, tab: str | None = _TAB, delay: float = 0.0) -> None:
        self._url = url.replace("http", "ws", 1)
        self._tab, self._delay = tab, delay
        self._stored: dict[str, str] = {}
        self.second = Second()
        self._parents: dict[str, str] = {}
        self._charts: dict[str, str] = {}  # title by uuid
        self._tabs: dict[str, str] = {}  # label by container
        self._control: str | None = None
        self._said = ""

    def connect(self, slow: bool = False) -> Connection:
        """Connects to the page. slow: emulates a slow line that reads some kilobytes at a time."""
        protocol: Any = [f"viser-v{__version__}"]
        line = socket()
        if slow:
            line.setsockopt(SOL_SOCKET, SO_RCVBUF, 8192)
        address = urlsplit(self._url)
        line.connect((address.hostname, address.port))
        queue = 1 if slow or self._delay else 16
        # Like a browser, this client sends no pings. If the machine were too busy to answer a ping, this
        # library would close the connection.
        connection = connect(
            self._url,
            sock=line,
            subprotocols=protocol,
            max_size=None,
            max_queue=queue,
            ping_interval=None,
        )
        self._forget()
        connection.send(pack(camera()))
        return connection

    def watch(self, client: int, asked: SimpleQueue[int]) -> None:
        """Stays connected until it is cancelled, and prints a line of JSON every second. asked: a
        queue of requests, each with the number of reloads to make."""
        while self._watch(client, asked):
            came = sum(self.visit() for _ in range(asked.get()))
            _tell({"client": client, "came": came})

    def _watch(self, client: int, asked: SimpleQueue[int]) -> bool:
        """Receives messages until a reload is requested. Returns False if the connection ends first."""
        with self.connect() as page:
            began = time.monotonic()
            while asked.empty():
                try:
                    self.hear(page, 0.2)
                except ConnectionClosed:
                    return False
                spent = time.monotonic() - began
                if spent >= 1.0:
                    _tell({"client": client, **self.second.rates(spent)})
                    began, self.second = time.monotonic(), Second()
        return True

    def visit(self) -> bool:
        """Connects, waits until a robot moved or its plots were updated, and disconnects."""
        self.second = Second()
        end = time.monotonic() + PATIENCE
        with self.connect() as page:
            while time.monotonic() < end:
                self.hear(page, 0.2)
                if self.second.plots or self.second.links:
                    return True
        return False

    def hear(self, page: Connection, timeout: float) -> None:
        """Receives one packet, if one arrives in time."""
        time.sleep(self._delay)
        try:
            raw = page.recv(timeout=timeout)
        except TimeoutError:
            return
        if isinstance(raw, bytes):
            self.second.bytes += len(raw)
            for message in messages_of(raw):
                self._take(page, message)
            self._tell_what_is_seen(page)

    @property
    def drawn(self) -> set[str]:
        """Returns the titles of the charts that were updated in the present `second`."""
        return {self._charts[uuid] for uuid in self.second.plots if uuid in self._charts}

    def show(self, tab: str | None) -> None:
        """Shows the plots of another tab; None: puts the whole page into the background."""
        self._tab = tab

    def _forget(self) -> None:
        self._parents, self._charts, self._tabs, self._control, self._said = {}, {}, {}, None, ""

    def _take(self, page: Connection, message: dict[str, Any]) -> None:
        self.second.messages += 1
        self._note(message)
        match message["type"]:
            case "GuiUpdateMessage" if "data" in message["updates"]:
                self.second.plots[message["uuid"]] += 1
            case "SceneNodeUpdateMessage" | "SetPositionMessage" | "SetOrientationMessage":
                self.second.links[f"{message['type']} {message.get('name')}"] += 1
            case "LocalStorageSetItemMessage":
                self._stored[message["key"]] = message["value"]
            case "LocalStorageGetItemRequestMessage":
                value = self._stored.get(message["key"])
                answer = _messages.LocalStorageGetItemResponseMessage(value, None, message["request_uuid"])
                page.send(pack(answer))
            case _:
                pass

    def _note(self, message: dict[str, Any]) -> None:
        """Stores the position of each chart in the page, and the control that reports the visible charts."""
        props = message.get("props", {})
        if "container_uuid" in message:
            self._parents[message["uuid"]] = message["container_uuid"]
        match message["type"]:
            case "ResetGuiMessage":
                self._forget()
            case "GuiUplotMessage":
                self._charts[message["uuid"]] = props["title"]
            case "GuiRemoveMessage":
                self._charts.pop(message["uuid"], None)
            case "GuiPanelMessage" | "GuiTabGroupMessage":
                self._tabs |= zip(props["_tab_container_ids"], props["_tab_labels"], strict=True)
            case "GuiUpdateMessage" if "_tab_labels" in message["updates"]:
                self._tab_ids(message["updates"])
            case "GuiTextMessage" if props["label"] == LABEL:
                self._control = message["uuid"]
            case _:
                pass

    def _tab_ids(self, updates: dict[str, Any]) -> None:
        if "_tab_container_ids" in updates:
            self._tabs |= zip(updates["_tab_container_ids"], updates["_tab_labels"], strict=True)

    def _tell_what_is_seen(self, page: Connection) -> None:
        titles = sorted(title for uuid, title in self._charts.items() if self._in_tab(uuid))
        seen = ASLEEP if self._tab is None else "\n".join([AWAKE, *titles])
        if self._control is not None and seen != self._said:
            self._said = seen
            page.send(pack(_messages.GuiUpdateMessage(self._control, {"value": seen})))

    def _in_tab(self, uuid: str) -> bool:
        while uuid in self._parents:
            uuid = self._parents[uuid]
        return self._tabs.get(uuid, self._tab) == self._tab


def _tell(line: dict[str, float]) -> None:
    # The line is written in one call, because other clients print as well.
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()


def main() -> None:
    """Runs clients as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url")
    parser.add_argument("--clients", type=int, default=1)
    parser.add_argument("--tab", default=_TAB)
    parser.add_argument("--delay", type=float, default=0.0)
    options = parser.parse_args()
    queues = [SimpleQueue[int]() for _ in range(options.clients)]
    threads = [
        threading.Thread(target=Viewer(options.url, options.tab, options.delay).watch, args=each, daemon=True)
        for each in enumerate(queues)
    ]
    for thread in threads:
        thread.start()
    for line in sys.stdin:
        queues[0].put(int(line))
    for thread in threads:
        thread.join()
    for thread in threads:
        thread.join()


if __name__ == "__main__":
    main()
