"""A program in a process of its own that reads lines and prints lines of JSON, so that its processor time and
memory are not those of the server that is measured."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from typing import Any, Self

from app.link.process import wait_until

LONG = 180.0
"""Time, s, within which the program must answer."""


class Child:
    """The program `python -m MODULE ARGUMENTS`. said: the lines that it has printed."""

    def __init__(self, module: str, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.pid = self._process.pid
        self.said: list[dict[str, Any]] = []
        self._heard = 0
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.said.append(json.loads(line))

    def say(self, line: object = "go on") -> None:
        """Writes a line for the program."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()

    def hear(self, key: str, within: float = LONG) -> dict[str, Any]:
        """Returns the next line that has this key; lines before it are skipped."""

        def place() -> int | None:
            return next((k for k in range(self._heard, len(self.said)) if key in self.said[k]), None)

        assert wait_until(lambda: place() is not None, within), f"{self._process.args} does not tell {key!r}"
        found = place()
        assert found is not None
        self._heard = found + 1
        return self.said[found]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(30.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def tell(**found: object) -> None:
    """Prints a line of JSON in one call, because other threads print as well."""
    sys.stdout.write(json.dumps(found) + "\n")
    sys.stdout.flush()
