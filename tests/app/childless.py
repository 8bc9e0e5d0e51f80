"""A worker whose fork server has reached the limit of processes. Simulations that the page's process starts
itself run normally."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable

from app.worker.entry import main

__all__ = ["main", "warm"]


def warm(say: Callable[[str], None]) -> None:
    say("nothing to be done")

    def refused() -> int:
        raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")

    os.fork = refused
