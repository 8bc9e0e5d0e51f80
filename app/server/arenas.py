"""The allocator's habits in the server's process."""

from __future__ import annotations

import ctypes
import os
import sys

_M_ARENA_MAX = -8  # malloc.h
ARENAS = 2


def few_arenas() -> bool:
    """Lets glibc's allocator have two arenas instead of eight per core; whether that was done.

    Every visit has threads of its own. Where each finds another arena, what a page leaves free in one is of
    no use to the next page, and free memory piles up (38 MB against 4 after 90 reloads). Python
    runs one thread at a time, so that nobody waits for an arena. For before threads start. An environment
    that says MALLOC_ARENA_MAX keeps its own number; other allocators are left as they are.
    """
    if sys.platform != "linux" or "MALLOC_ARENA_MAX" in os.environ:
        return False
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)  # musl has none
    return set_option is not None and bool(set_option(_M_ARENA_MAX, ARENAS))
