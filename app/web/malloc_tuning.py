"""Changes settings of the memory allocator in the server's process."""

from __future__ import annotations

import ctypes
import os
import sys

_M_MMAP_THRESHOLD, _M_ARENA_MAX = -3, -8  # malloc.h
ARENAS = 2
LARGE = 2**20
"""Size, B, from which an array gets memory pages of its own."""


def few_arenas() -> bool:
    """Limits glibc's allocator to two arenas instead of eight per core; returns whether that was done.

    Every visit has its own threads. If each thread uses a different arena, the next page cannot use memory
    that one page frees. Free memory then accumulates (38 MB instead of 4 MB after 90 reloads). Two arenas are
    enough: Python runs only one thread at a time, therefore no thread waits for an arena. Call this before
    threads start. A number in the environment variable MALLOC_ARENA_MAX is respected; other allocators are
    not changed.
    """
    return _set("MALLOC_ARENA_MAX", _M_ARENA_MAX, ARENAS)


def large_arrays_apart() -> bool:
    """Makes the allocator give every large array memory pages of its own, which return to the system when the
    array is freed. Returns whether that was done.

    By default, glibc does this only for arrays above a threshold. It raises the threshold to the size of the
    largest array ever freed, up to 32 MB. The recordings of a scene are then in an arena among small objects
    of other pages. When the scene ends, these objects keep the memory allocated: of 1.2 GB used by eight
    learners who changed scenes, 0.5 GB were free and not returned. A number in the environment variable
    MALLOC_MMAP_THRESHOLD_ is respected.
    """
    return _set("MALLOC_MMAP_THRESHOLD_", _M_MMAP_THRESHOLD, LARGE)


def give_back() -> None:
    """Returns every free memory page of the arenas to the system. This takes some milliseconds. Only with
    glibc."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


def _set(variable: str, option: int, value: int) -> bool:
    if sys.platform != "linux" or variable in os.environ:
        return False
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)  # musl does not have this function
    return set_option is not None and bool(set_option(option, value))
