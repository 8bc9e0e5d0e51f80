"""Clients that use the page's protocol and draw nothing: they receive and decode every message.

    python -m benchmarks.client URL [--clients K] [--tab TAB] [--delay SECONDS]

Each client is a `browsing.viewer.Viewer`. The program prints a line of JSON per second and client: the
messages, the megabytes, and how often the busiest plot and the busiest node of the scene were updated. With
--delay, a client waits this long before each packet, as on a slow connection. A number on stdin lets the
first client reload its page that many times. Each time, the client waits until it sees its robot; after the
last reload it prints a line. The clients leave when stdin ends.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from queue import SimpleQueue

import tyro

from app.link.process import wait_until
from benchmarks.child import Child, tell
from browsing.tab import Storage
from browsing.viewer import CURVES, Second, Viewer

PATIENCE = 60.0
"""Time, s, within which a robot must appear."""


class Viewers(Child):
    """Clients in a process of their own."""

    def __init__(self, url: str, clients: int, *options: str) -> None:
        super().__init__("benchmarks.client", url, "--clients", str(clients), *options)

    def reload(self, times: int) -> int:
        """Lets the first client reload its page. Returns how often it saw its robot."""
        self.say(times)
        return self.hear("came", 180.0 + PATIENCE * times)["came"]


def watch(url: str, tab: str, delay: float, client: int, asked: SimpleQueue[int]) -> None:
    """Stays connected, tells what arrives every second, and reloads when it is asked to."""
    storage = Storage()
    while True:
        with Viewer(url, storage, tab, delay=delay) as page:
            while asked.empty():
                page.second, began = Second(), time.monotonic()
                wait_until(lambda: not asked.empty(), 1.0, 0.1)
                if not page.is_open:
                    return
                tell(client=client, **page.second.rates(time.monotonic() - began))
        tell(client=client, came=sum(visited(url, storage) for _ in range(asked.get())))


def visited(url: str, storage: Storage) -> bool:
    """Connects, and returns whether a robot moved or its plots were updated in time."""
    with Viewer(url, storage) as page:
        return wait_until(lambda: bool(page.second.plots or page.second.links), PATIENCE)


def main(url: tyro.conf.Positional[str], clients: int = 1, tab: str = CURVES, delay: float = 0.0) -> None:
    """Does what the module says."""
    queues = [SimpleQueue[int]() for _ in range(clients)]
    for client, asked in enumerate(queues):
        threading.Thread(target=watch, args=(url, tab, delay, client, asked), daemon=True).start()
    for line in sys.stdin:
        queues[0].put(int(line))
    os._exit(0)


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
