"""A worker that leaves a second thread in the fork server, whose locks no child could ever open."""

from __future__ import annotations

import threading
from collections.abc import Callable

from app.worker.entry import main

__all__ = ["main", "warm"]


def warm(say: Callable[[str], None]) -> None:
    threading.Thread(target=threading.Event().wait, daemon=True).start()
