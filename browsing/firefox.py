"""Starts a Firefox and evaluates expressions in it by its protocol, WebDriver BiDi.

Firefox runs on a virtual screen, since it has no WebGL without a screen.
"""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from websockets.sync.client import connect
from websockets.sync.connection import Connection

NEEDED = ("firefox-esr", "Xvfb")
"""The names of the required programs in Debian."""
_PATIENCE = 120.0
"""Time limit for an answer, s."""


def missing() -> str | None:
    """Returns a message that names a missing program, or None if no program is missing."""
    for program in NEEDED:
        if shutil.which(program) is None:
            return f"no {program} found (Debian: apt-get install firefox-esr xvfb)"
    return None


class Tab:
    """A tab of a Firefox."""

    def __init__(self, socket: Connection) -> None:
        self._socket, self._numbers = socket, count(1)
        self._ask("session.new", capabilities={})
        self._target = {"context": self._ask("browsingContext.getTree", maxDepth=0)["contexts"][0]["context"]}

    def _ask(self, method: str, **params: Any) -> dict[str, Any]:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while (told := json.loads(self._socket.recv(_PATIENCE))).get("id") != number:
            pass  # an event
        if told["type"] == "error":
            raise RuntimeError(f"{method}: {told['message']}")
        return told["result"]

    def goto(self, address: str) -> None:
        """Opens a page and waits until it is loaded."""
        self._ask("browsingContext.navigate", **self._target, url=address, wait="complete")

    def evaluate(self, expression: str) -> Any:
        """Returns the value of an expression; it must be a JSON value or a promise of one.

        Raises:
            RuntimeError: the expression throws.
        """
        text = f"(async () => JSON.stringify((await ({expression})) ?? null))()"
        found = self._ask("script.evaluate", expression=text, target=self._target, awaitPromise=True)
        if found["type"] == "exception":
            raise RuntimeError(found["exceptionDetails"]["text"])
        return json.loads(found["result"]["value"])

    def screenshot(self) -> bytes:
        """Returns a PNG picture of the window."""
        return base64.b64decode(self._ask("browsingContext.captureScreenshot", **self._target)["data"])


@contextmanager
def firefox() -> Iterator[Tab]:
    """Yields a tab of a Firefox with a new profile and its own virtual screen; the `with` block ends both."""
    with TemporaryDirectory() as profile, _screen() as display:
        given = ("--no-remote", "--profile", profile, "--remote-debugging-port", "0", "about:blank")
        said = Path(profile, "said.txt")
        with said.open("w") as out:
            browser = subprocess.Popen(
                ("firefox-esr", *given), stdout=out, stderr=out, env={**os.environ, "DISPLAY": display}
            )
        try:
            with connect(f"{_address(browser, said)}/session", proxy=None, max_size=None) as socket:
                yield Tab(socket)
        finally:
            browser.terminate()
            browser.wait()


def _address(browser: subprocess.Popen[bytes], said: Path) -> str:
    """Waits until the browser has printed its address, and returns it."""
    until = time.monotonic() + _PATIENCE
    while (found := re.search(r"BiDi listening on (ws://\S+)\n", said.read_text())) is None:
        if browser.poll() is not None or time.monotonic() > until:
            raise RuntimeError(f"Firefox did not start: {said.read_text()}")
        time.sleep(0.1)
    return found[1]


@contextmanager
def _screen() -> Iterator[str]:
    """Starts a virtual screen and yields its name."""
    read, write = os.pipe()
    size = ("-screen", "0", "1440x900x24", "-nolisten", "tcp")
    screen = subprocess.Popen(
        ("Xvfb", "-displayfd", str(write), *size), pass_fds=[write], stderr=subprocess.DEVNULL
    )
    os.close(write)
    try:
        with os.fdopen(read) as told:
            yield f":{told.readline().strip()}"
    finally:
        screen.terminate()
        screen.wait()
