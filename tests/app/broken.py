"""A worker whose fork server fails to start. Simulations that the worker starts itself run normally."""

from __future__ import annotations

from collections.abc import Callable

from app.worker.entry import main

__all__ = ["main", "warm"]


def warm(say: Callable[[str], None]) -> None:
    raise RuntimeError("no fork server today")
