"""A client that speaks the page's protocol and draws nothing: it receives and decodes every message.

    python -m benchmarks.client URL

Answers what the page waits for (camera, empty local storage). Prints a line of JSON every second: messages,
megabytes, and how often the busiest plot and the busiest node of the scene were renewed.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from viser import __version__
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from browsing.wire import camera, messages_of, nothing_kept, pack


@dataclass
class Second:
    """What came within a second. plots, links: how often each chart and each node of the scene changed."""

    bytes: int = 0
    messages: int = 0
    plots: Counter[str] = field(default_factory=Counter)
    links: Counter[str] = field(default_factory=Counter)

    def rates(self, seconds: float) -> dict[str, float]:
        """Per second."""
        return {
            "megabytes_per_s": 1e-6 * self.bytes / seconds,
            "messages_hz": self.messages / seconds,
            "plots_hz": max(self.plots.values(), default=0) / seconds,
            "poses_hz": max(self.links.values(), default=0) / seconds,
        }


def watch(url: str) -> None:
    """Stays connected until it is ended, and prints a line of JSON every second."""
    protocol: Any = [f"viser-v{__version__}"]
    with connect(url.replace("http", "ws"), subprotocols=protocol, max_size=None) as socket:
        socket.send(pack(camera()))
        began, second = time.monotonic(), Second()
        while True:
            try:
                raw = socket.recv(timeout=0.2)
            except TimeoutError:
                raw = b""
            except ConnectionClosed:
                return
            if isinstance(raw, bytes) and raw:
                second.bytes += len(raw)
                for message in messages_of(raw):
                    _take(socket, message, second)
            spent = time.monotonic() - began
            if spent >= 1.0:
                print(json.dumps(second.rates(spent)), flush=True)
                began, second = time.monotonic(), Second()


def _take(socket: Connection, message: dict[str, Any], second: Second) -> None:
    second.messages += 1
    match message["type"]:
        case "GuiUpdateMessage" if "data" in message["updates"]:
            second.plots[message["uuid"]] += 1
        case "SceneNodeUpdateMessage" | "SetPositionMessage" | "SetOrientationMessage":
            second.links[f"{message['type']} {message.get('name')}"] += 1
        case "LocalStorageGetItemRequestMessage":
            socket.send(pack(nothing_kept(message["request_uuid"])))
        case _:
            pass


if __name__ == "__main__":
    watch(sys.argv[1])
