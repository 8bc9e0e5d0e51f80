"""The allocator's habits in the server's process."""

from __future__ import annotations

import ctypes
import os
import sys

_M_MMAP_THRESHOLD, _M_ARENA_MAX = -3, -8  # malloc.h
ARENAS = 2
LARGE = 2**20
"""B from which an array has pages of its own."""


def few_arenas() -> bool:
    """Lets glibc's allocator have two arenas instead of eight per core; whether that was done.

    Every visit has threads of its own. Where each finds another arena, what a page leaves free in one is of
    no use to the next page, and free memory piles up (38 MB against 4 after 90 reloads). Python
    runs one thread at a time, so that nobody waits for an arena. For before threads start. An environment
    that says MALLOC_ARENA_MAX keeps its own number; other allocators are left as they are.
    """
    return _set("MALLOC_ARENA_MAX", _M_ARENA_MAX, ARENAS)


def large_arrays_apart() -> bool:
    """Gives every large array pages of its own, which the system gets back when it is freed; whether that was
    done.

    Left alone, glibc raises the size from which it does that to the largest array that was ever freed, up
    to 32 MB. From then on what a scene has recorded lies in an arena among small objects of other pages; when
    the scene goes, they keep its pages: of 1.2 GB that eight learners took who changed scenes, 0.5 GB were
    free and not given back. An environment that says MALLOC_MMAP_THRESHOLD_ keeps its own number.
    """
    return _set("MALLOC_MMAP_THRESHOLD_", _M_MMAP_THRESHOLD, LARGE)


def give_back() -> None:
    """Gives the system every free page of the arenas, which takes some milliseconds; where the allocator is
    glibc's."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


def _set(variable: str, option: int, value: int) -> bool:
    if sys.platform != "linux" or variable in os.environ:
        return False
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)  # musl has none
    return set_option is not None and bool(set_option(option, value))
