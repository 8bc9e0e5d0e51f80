"""A fork server that takes long to become ready, and reports its progress."""

from __future__ import annotations

import time
from collections.abc import Callable

from stubborn import main

__all__ = ["main", "warm"]


def warm(say: Callable[[str], None]) -> None:
    for done in range(20):
        say(f"{done} of 20")
        time.sleep(0.3)
