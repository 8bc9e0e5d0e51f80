"""A tab without a browser: it keeps what the page stores, and opens again when its server is gone."""

from __future__ import annotations

import json
import re
import time
from typing import Any

from viser import _messages
from websockets.exceptions import InvalidHandshake, InvalidMessage

from browsing.wire import Wire

RETRY = 1.0
"""Time, s, after which viser's page tries to connect again."""
_TEXT = r'("(?:[^"\\]|\\.)*")'
_KEEP = re.compile(rf"sessionStorage\.setItem\({_TEXT}, {_TEXT}\)")
_COPY = re.compile(rf'localStorage\.setItem\({_TEXT}, sessionStorage\.getItem\({_TEXT}\) \?\? ""\)')
_PREFIX = "viser-user:"


class Storage:
    """What a browser keeps: for all its tabs, and for this one."""

    def __init__(self) -> None:
        self.local: dict[str, str] = {}
        self.session: dict[str, str] = {}

    def run(self, script: str) -> None:
        """Does what a script of the page does with the storages."""
        for key, text in _KEEP.findall(script):
            self.session[json.loads(key)] = json.loads(text)
        for to, key in _COPY.findall(script):
            self.local[json.loads(to)] = self.session.get(json.loads(key), "")


class Tab(Wire):
    """A page whose browser stores what it is told."""

    def __init__(self, url: str, storage: Storage) -> None:
        self.storage = storage
        super().__init__(url)

    @property
    def is_open(self) -> bool:
        """Whether the server has not closed the connection."""
        return self._reader.is_alive()

    def answered(self, header: str) -> str:
        """A header of the answer to the handshake."""
        response = self._socket.response
        return "" if response is None else response.headers[header]

    def _take(self, message: dict[str, Any]) -> None:
        match message["type"]:
            case "LocalStorageGetItemRequestMessage":
                value = self.storage.local.get(_PREFIX + message["key"])
                request = message["request_uuid"]
                self.say(_messages.LocalStorageGetItemResponseMessage(value, None, request))
            case "LocalStorageSetItemMessage":
                self.storage.local[_PREFIX + message["key"]] = message["value"]
            case "LocalStorageRemoveItemMessage":
                self.storage.local.pop(_PREFIX + message["key"], None)
            case "RunJavascriptMessage":
                self.storage.run(message["source"])
            case _:
                super()._take(message)


def opened(url: str, storage: Storage, within: float) -> Tab:
    """Opens a page, and tries again as viser's page does while no server takes it; raises TimeoutError after
    `within` seconds."""
    until = time.monotonic() + within
    while True:
        try:
            return Tab(url, storage)
        except (InvalidHandshake, InvalidMessage, OSError) as error:
            if time.monotonic() > until:
                raise TimeoutError(f"no server took the page within {within:g} s") from error
            time.sleep(RETRY)
