"""A worker whose fork server cannot be had: it never gets ready. Its children are as they should be."""

from __future__ import annotations

from collections.abc import Callable

from app.worker.entry import main

__all__ = ["main", "warm"]


def warm(say: Callable[[str], None]) -> None:
    raise RuntimeError("no fork server today")
