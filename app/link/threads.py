"""The one way in which app/ starts a thread."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any


def on_thread(name: str, function: Callable[..., Any], *args: object) -> threading.Thread:
    """Starts a thread that calls `function(*args)` beside the page's loop. It does not keep the program
    alive. The name of a function that is written for this ends with `_on_thread`. name: of the thread."""
    thread = threading.Thread(target=function, args=args, name=name, daemon=True)
    thread.start()
    return thread
