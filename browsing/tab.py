"""A tab without a browser: it stores the data of the page, and can be opened again if its server ends."""

from __future__ import annotations

import json
import re
import time
from typing import Any

from viser import _messages
from websockets.exceptions import InvalidHandshake, InvalidMessage

from browsing.wire import Wire

RETRY = 1.0
"""Time after which viser's page tries to connect again, s."""
_TEXT = r'("(?:[^"\\]|\\.)*")'
_KEEP = re.compile(rf"sessionStorage\.setItem\({_TEXT}, {_TEXT}\)")
_COPY = re.compile(rf'localStorage\.setItem\({_TEXT}, sessionStorage\.getItem\({_TEXT}\) \?\? ""\)')
_PREFIX = "viser-user:"


class Storage:
    """The storages of a browser: `local` for all its tabs, `session` for one tab."""

    def __init__(self) -> None:
        self.local: dict[str, str] = {}
        self.session: dict[str, str] = {}

    def run(self, script: str) -> None:
        """Applies the changes that a script of the page makes to the storages."""
        for key, text in _KEEP.findall(script):
            self.session[json.loads(key)] = json.loads(text)
        for to, key in _COPY.findall(script):
            self.local[json.loads(to)] = self.session.get(json.loads(key), "")


class Tab(Wire):
    """A page without a browser that stores data as a browser does."""

    def __init__(self, url: str, storage: Storage, slow: bool = False) -> None:
        self.storage = storage
        super().__init__(url, slow=slow)

    @property
    def is_open(self) -> bool:
        """Whether the connection to the server is open."""
        return self._reader.is_alive()

    def answered(self, header: str) -> str:
        """Returns a header of the answer to the handshake."""
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
    """Opens a page. As viser's page does, it tries again while no server accepts the page; it raises
    TimeoutError after `within` seconds."""
    until = time.monotonic() + within
    while True:
        try:
            return Tab(url, storage)
        except (InvalidHandshake, InvalidMessage, OSError) as error:
            if time.monotonic() > until:
                raise TimeoutError(f"no server took the page within {within:g} s") from error
            time.sleep(RETRY)
