"""A worker that starts a second thread in the fork server; a lock that this thread held could never be
released in a child."""

from __future__ import annotations

import threading
from collections.abc import Callable

from app.worker.entry import main

__all__ = ["main", "warm"]


def warm(say: Callable[[str], None]) -> None:
    threading.Thread(target=threading.Event().wait, daemon=True).start()
